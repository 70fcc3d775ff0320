"""From depth images and point clouds to hypotheses."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _feeler
from .errors import as_path, input_error, one_sentence
from .planner import Task, as_task
from .results import Result, fields


@one_sentence
class PosePerception:
    """Finds the target of a task. Make it once: it samples the surfaces of the target.

    Args:
        table: the uncertainty table of the task (``feeler perceive calibrate``); without one, only the pose is told.
    """

    def __init__(self, task: Task | str, table: str | os.PathLike[str] | None = None) -> None:
        self._task = as_task(task)
        self._core = _feeler.Finder(self._task._core, "" if table is None else as_path(table, "table"))

    def depth(self, image: ArrayLike, camera: dict[str, Any], background: ArrayLike | None = None) -> Result:
        """The target in a depth image.

        Args:
            image: (height, width), metres along the optical axis; 0, NaN and infinity: no reading.
            camera: ``fx``, ``fy``, ``cx``, ``cy`` in pixels and ``world_T_camera`` (4 x 4; x right, y down, z forward).
            background: the same camera's picture without the target.

        Returns:
            Result: ``found``, ``reason`` (why not), ``world_T_target``, ``fitness``, ``rms_m``, ``points``, ``covariance``;
            what else speaks for and against it: ``explained``, ``beyond``, ``seen_through``, ``missing_m2``;
            with a table ``world_T_estimate`` (the centre of the hypotheses), ``counts`` and ``extents``, those of the
            smallest problem of the table's family that covers them.
        """
        if isinstance(camera, dict) and 0 in (camera.get("fx"), camera.get("fy")):
            raise input_error("camera", "fx or fy is 0", "give focal lengths in pixels")
        behind = None if background is None else _picture(background, "background")
        return fields(self._core.in_depth(_picture(image, "depth"), camera, behind))

    def cloud(self, points: ArrayLike, eye_m: ArrayLike) -> Result:
        """The target in a cloud without background: (n, 3) metres, world frame, seen from ``eye_m``; as :meth:`depth`."""
        array = np.ascontiguousarray(np.asarray(points, dtype=np.float64))
        if array.ndim != 2 or array.shape[1] != 3:
            raise input_error("cloud", f"has shape {array.shape}", "give (n, 3), metres")
        return fields(self._core.in_cloud(array, np.asarray(eye_m, dtype=np.float64)))

    def look(self, seed: int = 1, episode: int = 0) -> Result:
        """What the simulated depth camera sees of a target somewhere in the workspace: ``depth``, ``background``, ``camera``
        (as :meth:`depth` takes them) and the true ``world_T_target``."""
        return Result(_feeler.look(self._task._core, seed, episode))


def _picture(image: ArrayLike, where: str) -> Any:
    array = np.asarray(image)
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise input_error(where, f"is {array.dtype} of shape {array.shape}", "give (height, width), metres")
    return np.ascontiguousarray(array, dtype=np.float32)


def perceive(
    task: Task | str,
    *,
    depth: ArrayLike | None = None,
    camera: dict[str, Any] | None = None,
    background: ArrayLike | None = None,
    cloud: ArrayLike | None = None,
    eye_m: ArrayLike | None = None,
    table: str | os.PathLike[str] | None = None,
) -> Result:
    """Finds the target once: in ``depth`` with its ``camera``, or in a ``cloud`` seen from ``eye_m``; see
    :class:`PosePerception`."""
    if (depth is None) == (cloud is None):
        raise input_error("perceive", "give either depth or cloud", "depth=..., camera=... or cloud=..., eye_m=...")
    finder = PosePerception(task, table)
    if depth is not None:
        if camera is None:
            raise input_error("camera", "missing", "give fx, fy, cx, cy and world_T_camera")
        return finder.depth(depth, camera, background)
    if eye_m is None:
        raise input_error("eye_m", "missing", "give where the camera stands")
    assert cloud is not None
    return finder.cloud(cloud, eye_m)
