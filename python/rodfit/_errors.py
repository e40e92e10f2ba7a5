"""Errors as exceptions."""

from __future__ import annotations


class RodfitError(Exception):
    """What rodfit refuses or cannot compute. ``file``, ``line``, ``key``, ``found`` and ``allowed`` say where and why, where
    they are known."""

    file: str | None = None
    line: int | None = None
    key: str | None = None
    found: str | None = None
    allowed: str | None = None


class InputError(RodfitError, ValueError):
    """An input is at fault."""


class ComputationError(RodfitError, RuntimeError):
    """The input is sound, and could not be computed."""


def refused(key: str, found: object, allowed: str) -> InputError:
    """The error of an argument."""
    error = InputError(f"{key}: found {found}, allowed: {allowed}")
    error.key, error.found, error.allowed = key, str(found), allowed
    return error
