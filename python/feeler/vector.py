"""Many insertions at once: the native vector environment as Gymnasium's."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from . import _feeler, spaces
from .environment import RENDER_MODES, check_cameras, check_counts, check_task, core_options, scene_of
from .errors import input_error, one_sentence

_MODES = {
    AutoresetMode.NEXT_STEP: "next-step",
    AutoresetMode.SAME_STEP: "same-step",
    AutoresetMode.DISABLED: "disabled",
}


class VectorInsertionEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """N environments over one compiled scene, stepped by a pool of threads in C++.

    ``gymnasium.make_vec(id, num_envs=16, vectorization_mode="vector_entry_point")`` makes one. Environment i does what an
    :class:`feeler.InsertionEnv` does with the same seed, bit for bit, for any number of threads: ``reset(seed=s)`` seeds
    environment i with s + i, and each plays the episodes 0, 1, 2, ... of its seed.

    Args (beside those of :class:`feeler.InsertionEnv`):
        num_envs: how many.
        threads: of the pool, the caller's among them.
        autoreset_mode: ``NEXT_STEP`` (the step after the end resets and ignores its action), ``SAME_STEP`` (the step that
            ends the episode resets as well; the last observation and info stand in ``info["final_obs"]`` and
            ``info["final_info"]``), ``DISABLED`` (``reset(options={"reset_mask": mask})`` is the caller's business).
        copy: True: arrays that are returned are fresh. False: they are views of the buffers, which the next call
            overwrites (flat observations only).
        info: False: ``infos`` stay empty, for speed (``final_obs`` and ``final_info`` stand in it all the same).

    For macro actions of different length, :meth:`send` and :meth:`recv` do not make the quick wait for the slow.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES[:2], "render_fps": 50}

    def __init__(
        self,
        num_envs: int = 1,
        task: str | os.PathLike[str] = "plug",
        *,
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        info: bool = True,
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
        if render_mode is not None and render_mode not in RENDER_MODES[:2]:
            raise input_error(
                "render_mode", f'"{render_mode}" shows one environment', "choose rgb_array or depth_array"
            )
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise input_error("num_envs", f"is {num_envs!r}", "give 1 or more")
        check_counts(control_steps=control_steps, width=width, height=height)
        if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int)):
            raise input_error("threads", f"are {threads!r}", "give 1 or more")
        if isinstance(autoreset_mode, str):
            names = {name.replace("-", "_"): mode for mode, name in _MODES.items()}
            key = (
                autoreset_mode.lower()
                .replace("-", "_")
                .replace("nextstep", "next_step")
                .replace("samestep", "same_step")
            )
            if key not in names:
                raise input_error(
                    "autoreset_mode", f'unknown mode "{autoreset_mode}"', f"choose from {', '.join(names)}"
                )
            autoreset_mode = names[key]
        self.num_envs = num_envs
        self._task = check_task(task)
        self._cameras = check_cameras(cameras)
        self._observations = observations
        self._plain = observations == "flat" and not self._cameras
        self._copy, self._info = copy, info
        self._mode = autoreset_mode
        self._render_camera = render_camera
        self.render_mode = render_mode
        self.single_observation_space = spaces.observation_space(observations, self._cameras, width, height)
        self.single_action_space = spaces.action_space(actions)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._single_shape: tuple[int, ...] = self.single_action_space.shape or ()
        self._shape = (num_envs, *self._single_shape)
        self.metadata = {
            **self.metadata,
            "autoreset_mode": autoreset_mode,
            "render_fps": max(1, round(1000 / max(1, control_steps))),
        }
        options = core_options(
            {
                "actions": actions,
                "control_steps": control_steps,
                "max_displacement_m": max_displacement_m,
                "max_turn_rad": max_turn_rad,
                "reward_per_second": reward_per_second,
                "reward_progress": reward_progress,
                "time_limit_s": time_limit_s,
                "width": width,
                "height": height,
            }
        )
        threads = min(num_envs, os.cpu_count() or 1) if threads is None else threads
        self._core: _feeler.Vector | None = _feeler.Vector(
            scene_of(self._task), num_envs, threads, _MODES[autoreset_mode], options
        )
        self._owner = os.getpid()
        self._views: tuple[Any, ...] = tuple(self._core.views())
        self._seeded = False
        self._options: dict[str, Any] = {}

    @property
    def core(self) -> _feeler.Vector:
        """The environments below. Raises InputError once closed, and in a process that was forked off: the threads of the
        pool stayed behind."""
        if self._core is None:
            raise input_error("vector environment", "is closed", "make a new one")
        if os.getpid() != self._owner:
            raise input_error("vector environment", "was made before the fork", "make one in the new process")
        return self._core

    def _observe(self) -> Any:
        flat = self._views[0]
        if self._plain:
            return flat.copy() if self._copy else flat
        if self._observations == "flat":
            observation: dict[str, Any] = {"state": flat.copy()}
        else:
            observation = {name: part.copy() for name, part in spaces.split(flat).items()}
        for camera in self._cameras:
            observation[f"image_{camera}"] = np.stack([self.core.render(i, camera) for i in range(self.num_envs)])
        return observation

    def _infos(self, arrays: dict[str, Any], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
        """Arrays over the environments as Gymnasium wants them: each with a mask of where it counts."""
        mask = np.ones(self.num_envs, dtype=bool) if mask is None else mask
        infos: dict[str, Any] = {}
        for name, values in arrays.items():
            infos[name] = np.array(values, dtype=object) if isinstance(values, list) else values
            infos[f"_{name}"] = mask.copy()
        return infos

    @one_sentence
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begins an episode in every environment, or in those of ``options["reset_mask"]`` (bool, (num_envs,)).

        Args:
            seed: environment i gets ``seed + i``, or the i-th of a sequence; None: the next episode of its seed.
            options: those of :meth:`feeler.InsertionEnv.reset` but ``episode``, for all environments until others are given.
        """
        core = self.core
        if options is not None and not isinstance(options, dict):
            raise input_error("options", f"are of type {type(options).__name__}", "give a dict")
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        if mask is None:
            chosen = np.ones(self.num_envs, dtype=bool)
        else:
            chosen = np.asarray(mask)
            if chosen.shape != (self.num_envs,) or chosen.dtype != np.bool_ or not chosen.any():
                raise input_error(
                    "reset_mask",
                    f"is {chosen.dtype} of shape {chosen.shape}",
                    f"give ({self.num_envs},) bool, one at least true",
                )
        seeds = self._seeds(seed)
        if mask is None or options:
            core.set_options(options)
        if not self._seeded and any(s is None for s, c in zip(seeds, chosen, strict=True) if c):
            drawn = int(np.random.default_rng().integers(2**62))
            seeds = [drawn + i if s is None else s for i, s in enumerate(seeds)]
        if chosen.all() and all(s is not None for s in seeds):
            core.reset([s for s in seeds if s is not None])
        else:
            for i in np.flatnonzero(chosen):
                core.reset_one(int(i), seeds[i])
        self._seeded = self._seeded or bool(chosen.all())
        infos = self._infos(core.infos(), chosen) if self._info else {}
        return self._observe(), infos

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        seeds: list[Any] = (
            [int(seed) + i for i in range(self.num_envs)]
            if isinstance(seed, int | np.integer) and not isinstance(seed, bool)
            else list(seed)  # type: ignore[arg-type]
        )
        if len(seeds) != self.num_envs:
            raise input_error("seed", f"{len(seeds)} seeds for {self.num_envs} environments", "give one each")
        for s in seeds:
            if s is not None and (not isinstance(s, int | np.integer) or not 0 <= s < 2**64):
                raise input_error("seed", f"is {s!r}", "give whole numbers from 0 to 2^64 - 1")
        return seeds

    def _answer(self, done: Sequence[int] | None = None) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        core = self.core
        _, rewards, terminated, truncated = self._views
        infos: dict[str, Any] = {}
        if self._info:
            infos = self._infos(core.infos())
        if self._mode == AutoresetMode.SAME_STEP:
            over = terminated | truncated
            if over.any():
                final = np.full(self.num_envs, None, dtype=object)
                for i in np.flatnonzero(over):
                    flat = core.final_observation(int(i))
                    final[i] = flat if self._observations == "flat" else spaces.split(flat)
                infos["final_obs"], infos["_final_obs"] = final, over.copy()
                infos["final_info"] = self._infos(core.final_infos(), over)
                infos["_final_info"] = over.copy()
        if self._copy:
            return self._observe(), rewards.copy(), terminated.copy(), truncated.copy(), infos
        return self._observe(), rewards, terminated, truncated, infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One action for each environment: (num_envs, size). Waits for all.

        An action that is not valid raises InputError naming the environment, and nothing has changed anywhere.
        """
        self.core.step(spaces.as_action(actions, self._shape, "actions"))
        return self._answer()

    @one_sentence
    def send(self, actions: Any, env_ids: Sequence[int] | None = None) -> None:
        """Starts an action in each of these idle environments (default: all) and returns at once."""
        ids = list(range(self.num_envs)) if env_ids is None else np.asarray(env_ids).tolist()
        self.core.send(ids, spaces.as_action(actions, (len(ids), *self._single_shape), "actions"))

    @one_sentence
    def recv(self, count: int = 1) -> tuple[NDArray[np.int64], Any, Any, Any, Any]:
        """Waits until at least ``count`` sent actions are done: the environments, ascending, each reported once, and rows
        of observations (flat), rewards, terminated and truncated for them."""
        done = np.array(self.core.receive(count), dtype=np.int64)
        flat, rewards, terminated, truncated = self._views
        return done, flat[done], rewards[done], terminated[done], truncated[done]

    def render(self) -> Any:
        """A tuple of pictures, one for each environment."""
        if self.render_mode is None:
            return None
        picture = self.core.render if self.render_mode == "rgb_array" else self.core.render_depth
        return tuple(picture(i, self._render_camera) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the threads."""
        if os.getpid() == self._owner:
            self._core = None
            self._views = ()

    def __del__(self) -> None:
        # In a forked process the pool has no threads to wait for: what belongs to the parent is left alone.
        if getattr(self, "_core", None) is not None and os.getpid() != self._owner:
            _ABANDONED.append(self.__dict__.pop("_core"))


_ABANDONED: list[Any] = []
