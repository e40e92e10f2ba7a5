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


def refused(key: str, found: object, allowed: str) -> InputError:
    """The error of an invalid argument."""
    error = InputError(f"{key}: found {found}, allowed: {allowed}")
    error.key, error.found, error.allowed = key, str(found), allowed
    return error
