"""The ids under which Gymnasium knows the environments; nothing else is loaded for them."""

from __future__ import annotations

from typing import Any


def _titles() -> dict[str, str]:
    """Shipped tasks by the name in their ids: ``plug-tight`` is ``feeler/PlugTight-v0``."""
    from . import _feeler

    return {"".join(part.capitalize() for part in task.split("-")): task for task in _feeler.list_tasks()}


def ids() -> list[str]:
    """Every id that is registered: ``feeler/Insertion-v0``, and three of every shipped task."""
    names = ["feeler/Insertion-v0"]
    for title in _titles():
        names += [f"feeler/{title}-v0", f"feeler/{title}Macro-v0", f"feeler/{title}MacroDiscrete-v0"]
    return names


def register() -> None:
    """Registers the environments with Gymnasium; does nothing where that has been done."""
    from gymnasium.envs.registration import register as add
    from gymnasium.envs.registration import registry

    if "feeler/Insertion-v0" in registry:
        return

    def one(name: str, kwargs: dict[str, Any]) -> None:
        # The environments refuse what is out of order themselves, and say more about it than the wrapper would.
        add(
            id=name,
            entry_point="feeler.environment:InsertionEnv",
            vector_entry_point="feeler.vector:VectorInsertionEnv",
            kwargs=kwargs,
            order_enforce=False,
            disable_env_checker=True,
        )

    one("feeler/Insertion-v0", {})
    for title, task in _titles().items():
        one(f"feeler/{title}-v0", {"task": task})
        one(f"feeler/{title}Macro-v0", {"task": task, "actions": "macro"})
        one(f"feeler/{title}MacroDiscrete-v0", {"task": task, "actions": "macro-discrete"})
