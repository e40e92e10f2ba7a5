"""Conversion of tables between Python and the JSON of the native part.

The module json is imported at its first use: its import takes longer than that of this package."""

from __future__ import annotations

import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any, TypeGuard


def written(value: object) -> str:
    """A value as JSON, which may contain numpy numbers and arrays, and paths."""
    import json

    return json.dumps(value, default=_plain)


def read(text: str) -> Any:
    """The value of a JSON text; its objects accept former keys."""
    import json

    from ._renamed import Table

    return json.loads(text, object_hook=Table)


def is_table(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether a value is a mapping."""
    from collections.abc import Mapping

    return isinstance(value, Mapping)


def _plain(value: Any) -> Any:
    """A path or a numpy value as a JSON value."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a type that a scene can contain")
