"""Errors that reach a user: one line each, ``WHERE: WHAT (HOW TO MEND)``."""

from __future__ import annotations

from ._feeler import Error, InputError, Interrupted, NegativeResult, WorldError

__all__ = ["Error", "InputError", "Interrupted", "NegativeResult", "WorldError", "input_error"]


def input_error(where: str, what: str, mend: str = "") -> InputError:
    """The error for bad input, in the form that all errors have."""
    return InputError(f"{where}: {what}" + (f" ({mend})" if mend else ""))
