"""Errors as exceptions."""

from __future__ import annotations


class RodfitError(Exception):
    """An invalid input or a failed computation. ``file``, ``line``, ``key``, ``found`` and ``allowed`` are None if they do
    not apply."""

    file: str | None = None
    line: int | None = None
    key: str | None = None
    found: str | None = None
    allowed: str | None = None


class InputError(RodfitError, ValueError):
    """An invalid input."""


class ComputationError(RodfitError, RuntimeError):
    """A failed computation with a valid input."""


def check_path(name: str, path: object, reader: str) -> None:
    """Refuses a TOML text in place of the name of its file. ``reader`` is the function that reads texts."""
    if isinstance(path, str) and "\n" in path:
        raise refused(name, "a text of several lines", f"the name of a TOML file. {reader} reads a text")


def check_count(count: int) -> None:
    """Refuses a negative number of modes."""
    if count < 0:
        raise refused("count", count, "0 or more")


def refused(key: str, found: object, allowed: str) -> InputError:
    """The error of an invalid argument."""
    error = InputError(f"{key}: found {found}, allowed: {allowed}")
    error.key, error.found, error.allowed = key, str(found), allowed
    return error
