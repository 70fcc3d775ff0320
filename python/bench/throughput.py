"""What Python costs: the package beside the library's own VectorEnv, the same steps in the same run.

    v/bin/python python/bench/throughput.py [--seconds 2]

CPU seconds of the stepping thread; blocks of both sides alternate, and the share is the median over the pairs of blocks, so
that other work on the machine counts little.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from statistics import median

import gymnasium
import numpy as np

import feeler
from feeler import _feeler
from feeler.environment import scene_of


def alternate(python: Callable[[], float], cpp: Callable[[], float], seconds: float, steps: int) -> dict[str, float]:
    """Steps a CPU second of two ways to do ``steps`` steps, each of which returns what it took."""
    pairs: list[tuple[float, float]] = []
    while sum(map(sum, pairs)) < seconds or len(pairs) < 5:
        pairs.append((python(), cpp()))
    return {
        "python_per_s": steps / median(p for p, _ in pairs),
        "cpp_per_s": steps / median(c for _, c in pairs),
        "share": median(c / p for p, c in pairs),
    }


def vector(control_steps: int, seconds: float) -> dict[str, float]:
    """Steps of 16 environments, in Python and in C++; flat observations, views, info off, one thread."""
    n, block = 16, max(1, 2000 // control_steps)
    options = {"control_steps": control_steps, "max_displacement_m": 1e-5, "max_turn_rad": 1e-5}
    env = gymnasium.make_vec(
        "feeler/Plug-v0", num_envs=n, vectorization_mode="vector_entry_point",
        threads=1, copy=False, info=False, **options,
    )  # fmt: skip
    actions = np.random.default_rng(1).uniform(-1, 1, (block, n, 6)).astype(np.float32)
    wide = actions.astype(np.float64)

    def python() -> float:
        env.reset(seed=3)
        start = time.thread_time()
        for action in actions:
            env.step(action)
        return time.thread_time() - start

    def cpp() -> float:
        return _feeler.time_vector(scene_of("plug"), n, {"actions": "control", **options}, wide, 3)

    return alternate(python, cpp, seconds, block * n)


def macro(seconds: float) -> dict[str, float]:
    """Macro actions of a single environment in Python, and of a vector of one in C++."""
    env = gymnasium.make("feeler/PlugMacro-v0").unwrapped
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (10, 8)).astype(np.float32)
    actions[:, 0], actions[:, 1:3], actions[:, 5] = 1, -1, np.abs(actions[:, 5])
    wide = actions[:, None].astype(np.float64)

    def python() -> float:
        env.reset(seed=3)
        start = time.thread_time()
        for action in actions:
            env.step(action)
        return time.thread_time() - start

    def cpp() -> float:
        return _feeler.time_vector(scene_of("plug"), 1, {"actions": "macro"}, wide, 3)

    return alternate(python, cpp, seconds, len(actions))


def mujoco_steps(seconds: float) -> tuple[str, float] | None:
    """Version and physics steps a CPU second of MuJoCo's own Python package on the same model, the arm at rest in the start
    pose without gravity; None where it is not installed or does not load the model."""
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string(scene_of("plug").xml)
    except Exception as error:
        print(f"mujoco: {error}")
        return None
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0
    data.qpos[:6] = feeler.InsertionEnv("plug").reset(seed=3)[0][:6]
    start, steps = time.thread_time(), 0
    while time.thread_time() - start < seconds:
        for _ in range(1000):
            mujoco.mj_step(model, data)
        steps += 1000
    return mujoco.__version__, steps / (time.thread_time() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="CPU seconds a measurement")
    seconds = parser.parse_args().seconds
    print(f"feeler {feeler.__version__}, plug, one thread")
    for control_steps in (20, 1):
        r = vector(control_steps, seconds)
        print(
            f"vector of 16, {control_steps:2d} control steps an action: {r['python_per_s']:9.0f} actions/s in Python, "
            f"{r['cpp_per_s']:9.0f} in C++: {r['share']:.3f}"
        )
    r = macro(seconds)
    print(
        f"single environment, macro actions: {r['python_per_s']:9.1f} actions/s in Python, {r['cpp_per_s']:9.1f} in C++: "
        f"{r['share']:.3f}"
    )
    own = mujoco_steps(seconds)
    if own is not None:
        ours = 20 * vector(20, seconds)["python_per_s"]
        print(
            f"physics steps a second: {ours:.0f} here, with control and sensing; {own[1]:.0f} by mj_step alone of the package "
            f"mujoco {own[0]}"
        )


if __name__ == "__main__":
    main()
