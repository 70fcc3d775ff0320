"""The executor turned around, for callers who cannot block."""

from __future__ import annotations

import atexit
import queue
import threading
import weakref
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import input_error
from .planner import Extents, PolicyGraph, Task
from .policy import Policy
from .results import Result
from .robot import MotionResult, Robot, execute


def _numbers(where: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if array.shape != shape or not np.isfinite(array).all():
        raise input_error(where, "is not of finite numbers", f"give {' x '.join(map(str, shape)) or 'one'}")
    return array


@dataclass(frozen=True)
class Motion:
    """What the robot is to do next.

    Attributes:
        kind: ``"transfer"``, ``"linear_move"``, ``"guarded"``, ``"compliant"`` or ``"zero_wrench"``.
        arguments: those of the method of :class:`feeler.Robot` with this name.
    """

    kind: str
    arguments: dict[str, Any] = field(default_factory=dict)


class _Ended(Exception):
    """The session was closed while a motion was due."""


class _Turned(Robot):
    """Waits in each motion for its result to be reported."""

    def __init__(self, pose: NDArray[np.float64]) -> None:
        self.motions: queue.Queue[Motion | None] = queue.Queue()
        self.answers: queue.Queue[Any] = queue.Queue()
        self.pose, self.wrench, self.now_s = pose, np.zeros(6), 0.0

    def _do(self, kind: str, **arguments: Any) -> Any:
        self.motions.put(Motion(kind, arguments))
        answer = self.answers.get()
        if answer is None:
            raise _Ended
        return answer

    def tool_pose(self) -> NDArray[np.float64]:
        return self.pose

    def contact_wrench(self) -> NDArray[np.float64]:
        return self.wrench

    def time(self) -> float:
        return self.now_s

    def zero_wrench(self) -> None:
        self._do("zero_wrench")

    def transfer(self, world_T_tool: Any) -> MotionResult:
        return self._do("transfer", world_T_tool=world_T_tool)

    def linear_move(self, world_T_tool: Any, speed_m_s: float, contact_force_n: float) -> MotionResult:
        return self._do("linear_move", world_T_tool=world_T_tool, speed_m_s=speed_m_s, contact_force_n=contact_force_n)

    def guarded(self, direction: Any, distance_m: float, speed_m_s: float, contact_force_n: float) -> MotionResult:
        return self._do(
            "guarded", direction=direction, distance_m=distance_m, speed_m_s=speed_m_s, contact_force_n=contact_force_n
        )

    def compliant(
        self,
        world_T_tool: Any,
        speed_m_s: float,
        force_limit_n: float,
        time_limit_s: float,
        stiffness_n_m: Any,
        rotational_stiffness_nm_rad: float,
        rest_time_s: float,
    ) -> MotionResult:
        return self._do(
            "compliant",
            world_T_tool=world_T_tool,
            speed_m_s=speed_m_s,
            force_limit_n=force_limit_n,
            time_limit_s=time_limit_s,
            stiffness_n_m=stiffness_n_m,
            rotational_stiffness_nm_rad=rotational_stiffness_nm_rad,
            rest_time_s=rest_time_s,
        )


# What is open when the interpreter ends is closed first: a thread that it would cut off in the library takes the process
# down with it.
_OPEN: weakref.WeakSet[Session] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    for session in list(_OPEN):
        session.close()


class Session:
    """One execution, motion by motion::

        session = feeler.Session("plug", (5, 5, 5), estimate, policy, pose=robot.tool_pose())
        while (motion := session.next()) is not None:
            result = ...                        # carry it out
            session.report(result, wrench=..., time_s=...)
        session.verdict.inserted

    Args (beside those of :func:`feeler.execute`):
        pose: (4, 4): where the tool is at the beginning.
    """

    def __init__(
        self,
        task: Task | str,
        extents: Extents,
        estimate: ArrayLike,
        policy: PolicyGraph | Policy,
        *,
        pose: ArrayLike,
        ladder: bool = False,
        contact_force_n: float = 5.0,
    ) -> None:
        self._robot = _Turned(_numbers("pose", pose, (4, 4)))
        self._pending: Motion | None = None
        self._verdict: Result | None = None
        self._error: BaseException | None = None
        self._ended = False

        def work() -> None:
            try:
                self._verdict = execute(
                    task, extents, estimate, policy, self._robot, ladder=ladder, contact_force_n=contact_force_n
                )
            except _Ended:
                pass
            except BaseException as error:
                self._error = error
            self._robot.motions.put(None)

        self._thread = threading.Thread(target=work, name="feeler session", daemon=True)
        self._thread.start()
        _OPEN.add(self)

    def next(self, timeout_s: float | None = None) -> Motion | None:
        """The next motion, the same one until it was reported; None once there is a verdict. What was wrong with an argument
        or a report is raised here. Raises TimeoutError when the planner takes longer than ``timeout_s``."""
        if self._pending is None and not self._ended:
            try:
                self._pending = self._robot.motions.get(timeout=timeout_s)
            except queue.Empty:
                raise TimeoutError("session: the next motion is not decided yet") from None
            self._ended = self._pending is None
        if self._error is not None:
            error, self._error = self._error, None
            raise error
        return self._pending

    def report(
        self, result: MotionResult | None = None, *, wrench: ArrayLike | None = None, time_s: float | None = None
    ) -> None:
        """How the motion of :meth:`next` went.

        Args:
            result: of the motion; None after ``zero_wrench``.
            wrench: (6,): the filtered wrench now, N and Nm.
            time_s: the clock of the robot now.
        """
        if self._pending is None:
            raise input_error("session", "no motion waits for a result", "call next first")
        if self._pending.kind == "zero_wrench":
            answer: Any = True
        else:
            if not isinstance(result, MotionResult):
                raise input_error(
                    "report", f"the result is of type {type(result).__name__}", "give a feeler.MotionResult"
                )
            answer = result
        seen = self._robot.wrench if wrench is None else _numbers("wrench", wrench, (6,))
        now_s = self._robot.now_s if time_s is None else float(_numbers("time_s", time_s, ()))
        self._robot.wrench, self._robot.now_s = seen, now_s
        if result is not None:
            self._robot.pose = result.world_T_tool
        self._pending = None
        self._robot.answers.put(answer)

    @property
    def verdict(self) -> Result | None:
        """The record of the execution, once :meth:`next` has returned None."""
        return self._verdict

    def close(self) -> None:
        """Gives the execution up."""
        if not self._ended:
            self._robot.answers.put(None)
            self._thread.join()
            self._ended = True
            self._pending = None

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *args: object) -> None:
        self.close()
