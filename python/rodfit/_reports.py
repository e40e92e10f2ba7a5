"""Reports that are not results of fits: designs of experiments and predictions."""

from __future__ import annotations

import os

from . import _rodfit
from ._scene import _Table
from ._tables import read

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class _Report(_Table):
    """A report: its entries in the JSON of the command are attributes."""

    def __init__(self, native: _rodfit.Report):
        super().__init__(read(native.json()))
        self._native = native

    def to_json(self) -> str:
        """The JSON that the command writes."""
        return self._native.json()

    def report(self, path: str | os.PathLike[str], title: str | None = None) -> None:
        """Writes the HTML page of the command's ``--report``."""
        page = self._native.page(os.path.basename(path) if title is None else title)
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def __repr__(self) -> str:
        return self._native.words()


class Design(_Report):
    """Expected uncertainties of planned measurements: ``parameters``, ``correlation``, ``budget``, ``contributions``,
    ``advice``, ``warnings`` and the other entries of ``rodfit design --json``."""

    parameters: list[dict[str, Any]]
    warning_codes: list[str]
    warnings: list[str]


class Prediction(_Report):
    """Errors of predictions without a fit: ``errors`` of each measurement, ``summary``, ``failed``, ``warnings`` and the other
    entries of ``rodfit predict --json``."""

    errors: list[dict[str, Any]]
    summary: list[dict[str, Any]]
    warning_codes: list[str]
    warnings: list[str]
