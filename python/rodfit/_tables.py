"""Tables between Python and the library, which takes and gives them as JSON.

What reads and writes JSON is imported where it is first needed: with its own imports it takes longer than this package."""

from __future__ import annotations

import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any, TypeGuard


def written(value: object) -> str:
    """As JSON; also numbers and arrays of numpy, and paths."""
    import json

    return json.dumps(value, default=_plain)


def read(text: str) -> Any:
    """The value of a JSON text; its objects accept former keys."""
    import json

    from ._renamed import Table

    return json.loads(text, object_hook=Table)


def is_table(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether it has keys with values."""
    from collections.abc import Mapping

    return isinstance(value, Mapping)


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is nothing that a scene holds")
