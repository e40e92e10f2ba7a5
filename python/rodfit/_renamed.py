"""Former names of entries, methods and arguments: they work for one version, with a DeprecationWarning."""

from __future__ import annotations

from . import _rodfit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any


def warn(former: str, current: str, stacklevel: int = 3) -> None:
    """Reports the use of a former name to the caller of the caller."""
    import warnings

    warnings.warn(f"{former} is deprecated, use {current}", DeprecationWarning, stacklevel=stacklevel)


def current_key(table: Mapping[str, Any], key: str) -> str | None:
    """The current key of a former one, if the table has it."""
    found = (current for former, current in _rodfit.renamed_keys() if former == key and current in table)
    return next(found, None)


class Table(dict[str, "Any"]):
    """A JSON object. ``table[key]`` accepts former keys."""

    def __missing__(self, key: str) -> Any:
        current = current_key(self, key)
        if current is None:
            raise KeyError(key)
        warn(key, current)
        return self[current]
