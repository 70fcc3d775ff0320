"""Errors that reach a user: one line each, ``WHERE: WHAT (HOW TO MEND)``."""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from ._feeler import Error, InputError, Interrupted, NegativeResult, WorldError

__all__ = [
    "Error",
    "InputError",
    "Interrupted",
    "NegativeResult",
    "WorldError",
    "as_path",
    "as_paths",
    "input_error",
    "one_sentence",
]

Checked = TypeVar("Checked", bound=Callable[..., Any])


def input_error(where: str, what: str, mend: str = "") -> InputError:
    """The error for bad input, in the form that all errors have."""
    return InputError(f"{where}: {what}" + (f" ({mend})" if mend else ""))


def as_path(path: Any, where: str) -> str:
    """The path of a file or folder as text."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise input_error(where, f"is of type {type(path).__name__}", "give a path, as text or pathlib.Path")
    return os.fspath(path)


def as_paths(paths: Any, where: str) -> list[str]:
    """Several of them."""
    if isinstance(paths, str | os.PathLike) or not isinstance(paths, Iterable):
        raise input_error(where, f"is of type {type(paths).__name__}", "give a list of paths")
    return [as_path(path, where) for path in paths]


def one_sentence(function: Checked) -> Checked:
    """A function, or a class with its public methods, that answers arguments of a wrong type by an InputError, where the
    binding would list all its signatures."""
    if inspect.isclass(function):
        for name, member in list(vars(function).items()):
            if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
                setattr(function, name, one_sentence(member))
        return function
    signature = inspect.signature(function)

    @functools.wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except TypeError as error:
            if "incompatible function arguments" not in str(error):
                raise
            given = signature.bind(*args, **kwargs).arguments
            types = [f"{name}: {type(value).__name__}" for name, value in given.items() if name != "self"]
        raise input_error(
            function.__qualname__.removesuffix(".__init__"),
            f"an argument has a wrong type or shape ({', '.join(types)})",
            "see its documentation",
        )

    return checked  # type: ignore[return-value]
