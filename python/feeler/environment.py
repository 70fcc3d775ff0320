"""One insertion as a Gymnasium environment."""

from __future__ import annotations

import copy
import os
from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from . import _feeler, spaces
from .errors import input_error

RENDER_MODES = ["rgb_array", "depth_array", "human"]


@lru_cache(maxsize=16)
def scene_of(task: str) -> _feeler.Scene:
    """The compiled scene of a task, shared by all environments of this process."""
    return _feeler.make_scene(task)


def check_task(task: Any) -> str:
    """The name or path as text."""
    if not isinstance(task, str | os.PathLike):
        raise input_error("task", f"is of type {type(task).__name__}", "give a name or a path of a task file")
    return os.fspath(task)


def check_counts(**values: Any) -> None:
    """Whole numbers, by name; their ranges are for those who take them."""
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | np.integer):
            raise input_error(name, f"is {value!r}", "give a whole number")


def check_cameras(cameras: Any) -> tuple[str, ...]:
    """Names of the cameras whose pictures are part of the observations."""
    if not isinstance(cameras, str | list | tuple):
        raise input_error("cameras", f"are of type {type(cameras).__name__}", "give a tuple of names")
    names = (cameras,) if isinstance(cameras, str) else tuple(cameras)
    for name in names:
        if name not in ("wrist", "static"):
            raise input_error("cameras", f'unknown camera "{name}"', "choose from wrist, static")
    return names


class InsertionEnv(gymnasium.Env[Any, Any]):
    """An insertion felt through a force sensor at the wrist: the tool is held over a target whose pose is known roughly.

    Actions (``actions``):

    ``"control"``
        Box(-1, 1, (6,), float32): displacement x y z and turn x y z of the set point of a compliant tool, world axes, in
        shares of ``max_displacement_m`` and ``max_turn_rad``; as a whole no longer than these. Then ``control_steps``
        milliseconds pass.
    ``"macro"``
        Box(-1, 1, (8,), float32): the largest of numbers 0 to 2 says which: guarded move, transfer, insertion. Numbers 3
        to 5: the direction of the guarded move, or the goal of the transfer from the start pose in shares of the
        workspace, in axes of the estimate. 6: its length, 0.5 to 100 mm, or the force limit of the insertion, 5 to 60 N.
        7: speed.
    ``"macro-discrete"``
        MultiDiscrete([8, 5, 3]): verb (:data:`feeler.spaces.VERBS`), length in cells of 1, 2, 4, 8, 16, speed of 5, 20,
        50 mm/s.

    Observations (``observations``): ``"flat"``, Box of 33 float64 (:func:`feeler.spaces.components` names them, with
    units), or ``"dict"``; ``cameras=("wrist", "static")`` adds pictures (height, width, 3), uint8. All bounds are finite.

    Reward: 1 when the tool is inserted, plus ``reward_per_second`` times simulated seconds, plus ``reward_progress``
    times the metres that the tool came nearer to where it is inserted (by the truth).

    ``terminated``: inserted, or something broke; ``truncated``: the time limit passed. The two are independent. After
    either, ``step`` is refused until the next ``reset``. ``info``: docs/python-environment.md.

    Laws: same seed and options, same episode, bit for bit, whatever ran before. ``reset(seed=s)`` begins episode 0 of the
    seed, every ``reset()`` after it the next one. Arrays that are returned are fresh: nothing changes them later.
    Pickling and deep copies keep the state.

    Args:
        task: name of a shipped task (:func:`feeler.list_tasks`) or path of a task file.
        time_limit_s: simulated seconds until an episode is truncated; default: the task's (120).
        render_mode: ``"rgb_array"`` (height, width, 3) uint8; ``"depth_array"`` (height, width) float32, metres along the
            optical axis; ``"human"``: a window (needs a display and ``ffplay``).
        render_camera: ``"overview"``, ``"close-up"``, ``"wrist"``, ``"static"``, or a camera of the task file.

    Raises:
        InputError: what is wrong with an argument, an action or an option, in one sentence; nothing has changed then.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 50}

    def __init__(
        self,
        task: str | os.PathLike[str] = "plug",
        *,
        actions: str = "control",
        observations: str = "flat",
        cameras: str | tuple[str, ...] = (),
        control_steps: int = 20,
        max_displacement_m: float = 0.002,
        max_turn_rad: float = 0.01,
        reward_per_second: float = 0.0,
        reward_progress: float = 0.0,
        time_limit_s: float | None = None,
        render_mode: str | None = None,
        render_camera: str = "overview",
        width: int = 640,
        height: int = 480,
    ) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise input_error("render_mode", f'unknown mode "{render_mode}"', f"choose from {', '.join(RENDER_MODES)}")
        check_counts(control_steps=control_steps, width=width, height=height)
        self._arguments: dict[str, Any] = {
            "task": check_task(task),
            "actions": actions,
            "observations": observations,
            "cameras": check_cameras(cameras),
            "control_steps": control_steps,
            "max_displacement_m": max_displacement_m,
            "max_turn_rad": max_turn_rad,
            "reward_per_second": reward_per_second,
            "reward_progress": reward_progress,
            "time_limit_s": time_limit_s,
            "render_mode": render_mode,
            "render_camera": render_camera,
            "width": width,
            "height": height,
        }
        self.task = self._arguments["task"]
        self.render_mode = render_mode
        self._core: _feeler.Environment | None = _feeler.Environment(scene_of(self.task), core_options(self._arguments))
        self._cameras: tuple[str, ...] = self._arguments["cameras"]
        self._plain = observations == "flat" and not self._cameras
        self.observation_space = spaces.observation_space(observations, self._cameras, width, height)
        self.action_space = spaces.action_space(actions)
        self._action_shape: tuple[int, ...] = self.action_space.shape or ()
        self.metadata = {**self.metadata, "render_fps": max(1, round(1000 / max(1, control_steps)))}
        self._seed: int | None = None
        self._episode = 0
        self._options: dict[str, Any] = {}
        self._window: Any = None

    @property
    def core(self) -> _feeler.Environment:
        """The environment below. Raises InputError once closed."""
        if self._core is None:
            raise input_error("environment", "is closed", "make a new one")
        return self._core

    def _observe(self, flat: NDArray[np.float64]) -> Any:
        if self._plain:
            return flat
        if self._arguments["observations"] == "flat":
            observation: dict[str, Any] = {"state": flat}
        else:
            observation = {name: part.copy() for name, part in spaces.split(flat).items()}
        for camera in self._cameras:
            observation[f"image_{camera}"] = self.core.render(camera)
        return observation

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: of all draws, not negative; begins with episode 0. None: the next episode of the same seed (of a drawn
                one at first).
            options: any of ``episode`` (number), ``estimate`` and ``target`` (4 x 4 poses), ``extents`` (hypotheses per
                axis of the task), ``hypotheses`` (a list of poses), ``noise`` (a name of ``feeler._feeler.noise_presets()``
                or a dict of fields), ``start`` (``"start"`` or ``"home"``), ``withhold_true_pose``, ``randomize``.
        """
        core = self.core
        if seed is not None and (
            isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed < 2**64
        ):
            raise input_error("seed", f"is {seed!r}", "give a whole number from 0 to 2^64 - 1")
        if options is not None and not isinstance(options, dict):
            raise input_error("options", f"are of type {type(options).__name__}", "give a dict")
        super().reset(seed=None if seed is None else int(seed))
        if seed is not None:
            number, episode = int(seed), 0
        elif self._seed is None:
            number, episode = int(self.np_random.integers(2**63)), 0
        else:
            number, episode = self._seed, self._episode + 1
        if options and options.get("episode") is not None:
            episode = options["episode"]
            if isinstance(episode, bool) or not isinstance(episode, int | np.integer) or not 0 <= episode < 2**63:
                raise input_error("episode", f"is {episode!r}", "give a whole number from 0 on")
        flat, _, _, _, info = core.reset(number, episode, options or {})
        self._seed, self._episode = number, int(episode)
        self._options = copy.copy(options or {})
        observation = self._observe(flat)
        if self.render_mode == "human":
            self.render()
        return observation, info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Carries an action out: observation, reward, terminated, truncated, info."""
        flat, reward, terminated, truncated, info = self.core.step(spaces.as_action(action, self._action_shape))
        observation = flat if self._plain else self._observe(flat)
        if self.render_mode == "human":
            self.render()
        return observation, reward, terminated, truncated, info

    def render(self) -> Any:
        """A picture of the world as it is, by ``render_mode``; None where that is None or ``"human"``."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode: give one to gymnasium.make")
            return None
        camera = self._arguments["render_camera"]
        if self.render_mode == "depth_array":
            return self.core.render_depth(camera)
        picture = self.core.render(camera)
        if self.render_mode == "rgb_array":
            return picture
        if self._window is None:
            from .window import Window

            self._window = Window(picture.shape[1], picture.shape[0], self.metadata["render_fps"], self.task)
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Lets go of the world and of the window; closing again does nothing."""
        if self._window is not None:
            self._window.close()
            self._window = None
        self._core = None

    def save(self) -> Any:
        """The whole state between steps, for :meth:`restore` of an environment of the same task in this process."""
        return (self.core.save(), self._seed, self._episode, dict(self._options), copy.deepcopy(self._np_random))

    def restore(self, state: Any) -> None:
        """Goes on from a saved state, bit for bit. Raises InputError for the state of another model."""
        if not (isinstance(state, tuple) and len(state) == 5 and isinstance(state[0], _feeler.EnvironmentState)):
            raise input_error("state", f"is of type {type(state).__name__}", "give what save() returned")
        core_state, seed, episode, options, generator = state
        self.core.restore(core_state)
        self._seed, self._episode, self._options = seed, episode, dict(options)
        self._np_random = copy.deepcopy(generator)

    def judge(self) -> dict[str, Any]:
        """The truth of the present instant: inserted, reason, depth_m, lateral_m, angle_rad."""
        return self.core.judge()

    @property
    def robot(self) -> _feeler.SimulatedRobot:
        """The simulated arm, for who drives it by motions (:class:`feeler.Robot`). What it does is no part of the actions
        that pickling repeats: an environment whose robot was used can be copied, and not pickled, until the next reset."""
        return self.core.robot

    def __deepcopy__(self, memo: dict[int, Any]) -> InsertionEnv:
        twin = type(self)(**self._arguments)
        twin.spec = self.spec
        if self._core is None:
            twin.close()
        elif self._seed is not None:
            twin.restore(self.save())
        else:
            twin._np_random = copy.deepcopy(self._np_random)
        return twin

    def __getstate__(self) -> dict[str, Any]:
        state: dict[str, Any] = {
            "arguments": self._arguments,
            "spec": self.spec,
            "closed": self._core is None,
            "seed": self._seed,
            "episode": self._episode,
            "options": self._options,
            "generator": self._np_random,
        }
        if self._core is not None and self._seed is not None:
            if not self._core.replayable:
                raise input_error("pickle", "the robot of the environment was used", "reset it first, or copy it")
            state["history"] = self._core.history
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        InsertionEnv.__init__(self, **state["arguments"])
        self.spec = state["spec"]
        self._np_random = state["generator"]
        self._seed, self._episode, self._options = state["seed"], state["episode"], state["options"]
        if state["closed"]:
            self.close()
        elif self._seed is not None:
            # The same actions from the same seed: the same state, bit for bit.
            self.core.reset(self._seed, self._episode, self._options)
            for action in state["history"].reshape(-1, self._action_shape[0]):
                self.core.step(action)


def core_options(arguments: dict[str, Any]) -> dict[str, Any]:
    """What the environment below is told."""
    keys = ("actions", "control_steps", "max_displacement_m", "max_turn_rad", "reward_per_second", "reward_progress")
    return {key: arguments[key] for key in (*keys, "time_limit_s", "width", "height")}
