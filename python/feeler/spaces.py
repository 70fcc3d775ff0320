"""Spaces, and what an observation is made of."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from . import _feeler
from .errors import input_error

VERBS = ("+x", "-x", "+y", "-y", "+z", "-z", "start", "insert")
"""What the first number of a discrete macro action means: guarded moves in axes of the estimate, a transfer back to the
start pose, an insertion."""
LENGTHS_CELLS = (1, 2, 4, 8, 16)
SPEEDS_M_S = (0.005, 0.02, 0.05)

PARTS: dict[str, slice] = {
    "q": slice(0, 6),
    "qd": slice(6, 12),
    "tool_position": slice(12, 15),
    "tool_quaternion": slice(15, 19),
    "raw_wrench": slice(19, 25),
    "filtered_wrench": slice(25, 31),
    "contact": slice(31, 32),
    "travelled": slice(32, 33),
}
"""The components of a flat observation, which are the entries of a Dict observation."""


@lru_cache(maxsize=1)
def components() -> tuple[tuple[str, str, float, float], ...]:
    """Name, unit, low and high of each number of a flat observation."""
    return tuple(_feeler.observation_space())


def flat_observation_space() -> gymnasium.spaces.Box:
    """33 numbers, float64, every bound finite: readings beyond the range of a sensor stay at its end."""
    rows = components()
    low = np.array([row[2] for row in rows])
    high = np.array([row[3] for row in rows])
    return gymnasium.spaces.Box(low, high, dtype=np.float64)


def observation_space(observations: str, cameras: tuple[str, ...], width: int, height: int) -> gymnasium.Space[Any]:
    """``observations``: ``"flat"`` or ``"dict"``; with cameras it is a Dict in either case."""
    if observations not in ("flat", "dict"):
        raise input_error("observations", f'unknown kind "{observations}"', "choose flat or dict")
    flat = flat_observation_space()
    if observations == "flat" and not cameras:
        return flat
    parts: dict[str, gymnasium.Space[Any]] = {}
    if observations == "flat":
        parts["state"] = flat
    else:
        for name, part in PARTS.items():
            parts[name] = gymnasium.spaces.Box(flat.low[part], flat.high[part], dtype=np.float64)
    for camera in cameras:
        parts[f"image_{camera}"] = gymnasium.spaces.Box(0, 255, (height, width, 3), dtype=np.uint8)
    return gymnasium.spaces.Dict(parts)


def action_space(actions: str) -> gymnasium.Space[Any]:
    """``"control"``: Box of 6; ``"macro"``: Box of 8; ``"macro-discrete"``: MultiDiscrete."""
    size = _feeler.action_size(actions)
    if actions == "macro-discrete":
        return gymnasium.spaces.MultiDiscrete([len(VERBS), len(LENGTHS_CELLS), len(SPEEDS_M_S)])
    return gymnasium.spaces.Box(-1.0, 1.0, (size,), dtype=np.float32)


def as_action(action: Any, shape: tuple[int, ...], where: str = "action") -> NDArray[np.float64]:
    """The numbers of an action, float64. Raises InputError for what is no array of numbers of this shape."""
    try:
        values = np.asarray(action)
    except (TypeError, ValueError):
        values = np.asarray(None)
    if values.dtype.kind not in "fiu":
        raise input_error(where, f"is of type {values.dtype}", "give real numbers")
    if values.shape != shape:
        raise input_error(where, f"has shape {values.shape}", f"give {shape}")
    return np.ascontiguousarray(values, dtype=np.float64)


def split(flat: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """A flat observation (or rows of them) as the entries of a Dict observation: views."""
    return {name: flat[..., part] for name, part in PARTS.items()}
