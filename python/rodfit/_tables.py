"""Conversion of tables between Python and the JSON of the native part.

The module json is imported at its first use: its import takes longer than that of this package."""

from __future__ import annotations

import os
import sys

from ._errors import refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any, TypeGuard

LARGEST = sys.float_info.max


def written(value: object, key: str = "") -> str:
    """A value as JSON, which may contain numpy numbers and arrays, and paths. ``key`` is its name in messages."""
    import json

    text = json.dumps(value, default=_plain)
    # Only these values have no JSON, or no TOML.
    if "N" in text or "I" in text or "null" in text:
        for name, found, allowed in _without_text(key, value):
            raise refused(name, found, allowed)
    return text


def read(text: str) -> Any:
    """The value of a JSON text; its objects accept former keys."""
    import json

    from ._renamed import Table

    return json.loads(text, object_hook=Table)


def is_table(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether a value is a mapping."""
    from collections.abc import Mapping

    return isinstance(value, Mapping)


def _without_text(key: str, value: Any) -> Iterator[tuple[str, object, str]]:
    """Key, value and allowed values of the entries that are NaN, infinite or None."""
    value = value.tolist() if hasattr(value, "tolist") else value
    if is_table(value):
        for name, inner in value.items():
            yield from _without_text(f"{key}.{name}".lstrip("."), inner)
    elif isinstance(value, (list, tuple)):
        for index, inner in enumerate(value):
            yield from _without_text(f"{key}[{index}]", inner)
    elif value is None:
        yield key, value, "a value. Leave the key out for its default"
    elif isinstance(value, float) and not abs(value) <= LARGEST:
        yield key, value, "a finite number"


def _plain(value: Any) -> Any:
    """A path or a numpy value as a JSON value."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a type that a scene can contain")
