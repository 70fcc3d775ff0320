"""Results: dictionaries whose keys are attributes as well."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class Result(dict[str, Any]):
    """What a command answers: the keys of its ``--json`` output as keys and as attributes (``result.ratio``)."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no field {name!r}: {', '.join(self)}") from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.items() if not isinstance(v, Mapping | list))})"


def fields(value: Any) -> Any:
    """Mappings within lists and mappings, to any depth, as :class:`Result`."""
    if isinstance(value, Mapping):
        return Result({key: fields(item) for key, item in value.items()})
    if isinstance(value, list):
        return [fields(item) for item in value]
    return value
