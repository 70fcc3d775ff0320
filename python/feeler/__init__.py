"""Feeler: high-precision insertions by touch.

Environments (docs/python-environment.md)::

    import gymnasium, feeler
    env = gymnasium.make("feeler/Plug-v0")
    observation, info = env.reset(seed=1)

The planner (docs/python-planner.md)::

    result = feeler.solve("plug", extents=(5, 5, 5))
    result.expected_cost, result.ratio, result.policy.draw()

SI units throughout: metres, radians, seconds, newtons. Poses are 4 x 4 matrices; ``world_T_tool`` maps coordinates of the
tool to those of the world. What is wrong with an input is said by :class:`InputError` (a ``ValueError``).
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _feeler

_data = Path(__file__).parent / "data"
if _data.is_dir():
    _feeler.set_data_folder(str(_data))

from .errors import Error, InputError, Interrupted, NegativeResult, WorldError
from .registration import register

__version__: str = _feeler.__version__

# Names that are loaded when first used: `import feeler` stays quick.
_LAZY = {
    "InsertionEnv": "environment",
    "VectorInsertionEnv": "vector",
    "Task": "planner",
    "ContactMap": "planner",
    "Problem": "planner",
    "PolicyGraph": "planner",
    "Result": "results",
    "list_tasks": "planner",
    "load_task": "planner",
    "contact_map": "planner",
    "solve": "planner",
    "evaluate": "planner",
    "lattice_problem": "planner",
    "read_problem": "planner",
    "Cancellation": "planner",
    "Database": "database",
    "preprocess": "database",
    "merge": "database",
    "Policy": "policy",
    "Belief": "policy",
    "Move": "policy",
    "Insert": "policy",
    "GiveUp": "policy",
    "Spiral": "policy",
    "Robot": "robot",
    "MotionResult": "robot",
    "CameraView": "robot",
    "ForwardingRobot": "robot",
    "execute": "robot",
    "Session": "session",
    "Episode": "episodes",
    "Run": "episodes",
    "run": "episodes",
    "read_records": "episodes",
    "policy_names": "episodes",
    "fault_names": "episodes",
    "PosePerception": "perception",
    "perceive": "perception",
    "export_episodes": "export",
    "Demonstrations": "export",
    "load_npz": "export",
    "experiments": "experiments",
    "experiment": "experiments",
    "report": "experiments",
}

__all__ = ["Error", "InputError", "Interrupted", "NegativeResult", "WorldError", "__version__", "register", *_LAZY]

if TYPE_CHECKING:
    from .database import Database, merge, preprocess
    from .environment import InsertionEnv
    from .episodes import Episode, Run, fault_names, policy_names, read_records, run
    from .experiments import experiment, experiments, report
    from .export import Demonstrations, export_episodes, load_npz
    from .perception import PosePerception, perceive
    from .planner import (
        Cancellation,
        ContactMap,
        PolicyGraph,
        Problem,
        Task,
        contact_map,
        evaluate,
        lattice_problem,
        list_tasks,
        load_task,
        read_problem,
        solve,
    )
    from .policy import Belief, GiveUp, Insert, Move, Policy, Spiral
    from .results import Result
    from .robot import CameraView, ForwardingRobot, MotionResult, Robot, execute
    from .session import Session
    from .vector import VectorInsertionEnv


def __getattr__(name: str) -> Any:
    module = _LAZY.get(name)
    if module is None:
        raise AttributeError(f"module 'feeler' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{module}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


register()
