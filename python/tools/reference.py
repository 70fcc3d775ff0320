"""Writes the reference of the package from its docstrings: ``python python/tools/reference.py > docs/python-reference.md``."""

from __future__ import annotations

import inspect
import textwrap

import feeler


def _signature(value: object, name: str) -> str:
    try:
        text = str(inspect.signature(value))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        text = "(...)"
    return f"{name}{text}"


def _doc(value: object) -> str:
    return textwrap.dedent(inspect.getdoc(value) or "").strip()


def reference() -> str:
    """The page as text."""
    parts = [
        "# Reference of the Python package\nMade from the docstrings by `python/tools/reference.py`; do not edit.\n"
    ]
    for name in feeler.__all__:
        value = getattr(feeler, name)
        if not callable(value):
            continue
        parts.append(f"## feeler.{name}\n```python\n{_signature(value, name)}\n```\n{_doc(value)}\n")
        if not inspect.isclass(value) or value.__module__.endswith("_feeler"):
            continue
        for member, item in vars(value).items():
            if member.startswith("_") or not (inspect.isfunction(item) or isinstance(item, property)) or not _doc(item):
                continue
            title = member if isinstance(item, property) else _signature(item, member)
            parts.append(f"**{name}.{title}**\n\n{_doc(item)}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    print(reference(), end="")
