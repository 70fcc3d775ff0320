"""Robots of one's own, in Python, and the executor that drives them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _feeler
from ._feeler import CameraView, MotionResult
from .errors import input_error, one_sentence
from .planner import Extents, PolicyGraph, Task, as_task, require_policy_for
from .policy import Policy
from .results import Result, fields

Pose = NDArray[np.float64]


class Robot(ABC):
    """The robot as the executor sees it. Poses are 4 x 4, of the tool reference frame in the world (base) frame. Calls
    block until the motion ends. ``look`` and ``follow_twist`` are for robots with an eye on the wrist.

    What a method raises ends the execution and comes out of the call that began it; so does an answer that is no answer
    (numbers that are not finite, a pose that is none, something else than a :class:`feeler.MotionResult`).
    """

    @abstractmethod
    def tool_pose(self) -> Pose:
        """Where the tool is, as measured."""

    @abstractmethod
    def contact_wrench(self) -> NDArray[np.float64]:
        """(6,): filtered force (N) and torque (Nm) of contact on the tool, at its origin, world axes; gravity compensated."""

    @abstractmethod
    def zero_wrench(self) -> None:
        """Takes the present wrench as zero; the tool is free."""

    @abstractmethod
    def time(self) -> float:
        """Seconds since the episode began, simulated or real."""

    @abstractmethod
    def transfer(self, world_T_tool: Pose) -> MotionResult:
        """Free-space motion around obstacles."""

    @abstractmethod
    def linear_move(self, world_T_tool: Pose, speed_m_s: float, contact_force_n: float) -> MotionResult:
        """Straight motion to a pose, fast, watched for contact all the way."""

    @abstractmethod
    def guarded(
        self, direction: NDArray[np.float64], distance_m: float, speed_m_s: float, contact_force_n: float
    ) -> MotionResult:
        """Straight motion along a unit vector (world axes) that stops at first contact; the orientation is held."""

    @abstractmethod
    def compliant(
        self,
        world_T_tool: list[Pose],
        speed_m_s: float,
        force_limit_n: float,
        time_limit_s: float,
        stiffness_n_m: NDArray[np.float64],
        rotational_stiffness_nm_rad: float,
        rest_time_s: float,
    ) -> MotionResult:
        """Compliant motion through way points (Cartesian impedance; stiffness in tool axes)."""

    def contact(self, direction: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """What a contact met along a unit vector (world axes) is like as the robot stands: effective mass where the tool
        cannot turn (kg), where it can (kg), stiffness of the parts (N/m), damping ratio, reaction time (s), force noise (N)
        and, optional, with what force the drive pushes against the friction of its joints in free motion (N). The speed of probes follows from it. None: a heavy arm with hard parts is assumed."""
        return None

    def look(self) -> CameraView:
        """What the camera on the wrist sees; without one: an empty view."""
        return CameraView.none()

    def follow_twist(
        self,
        tool_T_frame: Pose,
        linear_m_s: NDArray[np.float64],
        angular_rad_s: NDArray[np.float64],
        duration_s: float,
        contact_force_n: float,
    ) -> MotionResult:
        """A motion with a given velocity of a frame that is fixed to the tool, in its own axes, for a time."""
        return MotionResult("unplanned", 0.0, False, 0.0, self.tool_pose(), "this robot follows no twist")


class ForwardingRobot(Robot):
    """Hands every call on to another robot, the simulated one for instance: a base for drivers that log, delay or alter."""

    def __init__(self, robot: Any) -> None:
        self.robot = robot

    def tool_pose(self) -> Pose:
        return self.robot.tool_pose()

    def contact_wrench(self) -> NDArray[np.float64]:
        return self.robot.contact_wrench()

    def zero_wrench(self) -> None:
        self.robot.zero_wrench()

    def time(self) -> float:
        return self.robot.time()

    def transfer(self, world_T_tool: Pose) -> MotionResult:
        return self.robot.transfer(world_T_tool)

    def linear_move(self, world_T_tool: Pose, speed_m_s: float, contact_force_n: float) -> MotionResult:
        return self.robot.linear_move(world_T_tool, speed_m_s, contact_force_n)

    def guarded(
        self, direction: NDArray[np.float64], distance_m: float, speed_m_s: float, contact_force_n: float
    ) -> MotionResult:
        return self.robot.guarded(direction, distance_m, speed_m_s, contact_force_n)

    def compliant(
        self,
        world_T_tool: list[Pose],
        speed_m_s: float,
        force_limit_n: float,
        time_limit_s: float,
        stiffness_n_m: NDArray[np.float64],
        rotational_stiffness_nm_rad: float,
        rest_time_s: float,
    ) -> MotionResult:
        return self.robot.compliant(
            world_T_tool,
            speed_m_s,
            force_limit_n,
            time_limit_s,
            stiffness_n_m,
            rotational_stiffness_nm_rad,
            rest_time_s,
        )

    def contact(self, direction: NDArray[np.float64]) -> NDArray[np.float64] | None:
        return self.robot.contact(direction)

    def look(self) -> CameraView:
        return self.robot.look()

    def follow_twist(
        self,
        tool_T_frame: Pose,
        linear_m_s: NDArray[np.float64],
        angular_rad_s: NDArray[np.float64],
        duration_s: float,
        contact_force_n: float,
    ) -> MotionResult:
        return self.robot.follow_twist(tool_T_frame, linear_m_s, angular_rad_s, duration_s, contact_force_n)


@one_sentence
def execute(
    task: Task | str,
    extents: Extents,
    estimate: ArrayLike,
    policy: PolicyGraph | Policy,
    robot: Robot,
    *,
    ladder: bool = False,
    contact_force_n: float = 5.0,
) -> Result:
    """Carries a policy out on a robot: to the start pose, localize by touch, insert. Nothing is simulated.

    Args:
        extents: hypotheses per axis of the task; the policy is for them.
        estimate: (4, 4): where the target is believed to be, world frame.
        policy: a graph (``solve(...).policy``, ``Database.get(...).policy``) or a policy in Python.
        ladder: whether fallbacks follow when the policy does not come to an insertion.

    Returns:
        Result: the episode record (docs/file-formats.md) as far as the executor knows it; what it calls ``inserted`` and
        ``localized`` is believed, not judged.
    """
    loaded = as_task(task)
    if isinstance(policy, PolicyGraph):
        require_policy_for(policy, loaded, extents)
        given: Any = policy._core
    elif isinstance(policy, Policy):
        given = policy._for_episode(0, 0)
    else:
        raise input_error("policy", f"is of type {type(policy).__name__}", "give a PolicyGraph or a feeler.Policy")
    if not isinstance(robot, Robot):
        raise input_error("robot", f"is of type {type(robot).__name__}", "subclass feeler.Robot")
    pose = np.asarray(estimate, dtype=float)
    if pose.shape != (4, 4):
        raise input_error("estimate", f"has shape {pose.shape}", "give a 4 x 4 pose")
    return fields(_feeler.execute(loaded._core, extents, pose, given, robot, ladder, contact_force_n))
