"""What Python costs: the package beside the library's own VectorEnv, the same steps in the same run.

    v/bin/python python/bench/throughput.py [--seconds 2]

CPU seconds of the stepping thread, so that other work on the machine does not count; blocks of both sides alternate.
"""

from __future__ import annotations

import argparse
import time

import gymnasium
import numpy as np

import feeler
from feeler import _feeler
from feeler.environment import scene_of


def vector(control_steps: int, seconds: float) -> dict[str, float]:
    """Steps of 16 environments a CPU second, in Python and in C++; flat observations, views, info off, one thread."""
    n, block = 16, max(1, 2000 // control_steps)
    options = {"control_steps": control_steps, "max_displacement_m": 1e-5, "max_turn_rad": 1e-5}
    env = gymnasium.make_vec(
        "feeler/Plug-v0", num_envs=n, vectorization_mode="vector_entry_point",
        threads=1, copy=False, info=False, **options,
    )  # fmt: skip
    actions = np.random.default_rng(1).uniform(-1, 1, (block, n, 6)).astype(np.float32)
    wide = actions.astype(np.float64)
    python_s = cpp_s = 0.0
    blocks = 0
    while python_s + cpp_s < seconds:
        env.reset(seed=3)
        start = time.thread_time()
        for action in actions:
            env.step(action)
        python_s += time.thread_time() - start
        cpp_s += _feeler.time_vector(scene_of("plug"), n, {"actions": "control", **options}, wide, 3)
        blocks += 1
    steps = blocks * block * n
    return {"python_per_s": steps / python_s, "cpp_per_s": steps / cpp_s, "share": cpp_s / python_s}


def macro(seconds: float) -> dict[str, float]:
    """Single environment: CPU seconds of macro actions in Python and of the same steps by a vector of one in C++."""
    env = gymnasium.make("feeler/PlugMacro-v0").unwrapped
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (10, 8)).astype(np.float32)
    actions[:, 0], actions[:, 1:3], actions[:, 5] = 1, -1, np.abs(actions[:, 5])
    python_s = cpp_s = 0.0
    while python_s + cpp_s < seconds:
        env.reset(seed=3)
        start = time.thread_time()
        for action in actions:
            env.step(action)
        python_s += time.thread_time() - start
        cpp_s += _feeler.time_vector(scene_of("plug"), 1, {"actions": "macro"}, actions[:, None].astype(np.float64), 3)
    return {"share": cpp_s / python_s}


def mujoco_steps(seconds: float) -> float | None:
    """Physics steps a CPU second of MuJoCo's own Python package on the same model; None where it is not installed or does
    not load the model."""
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string(scene_of("plug").xml)
    except Exception as error:
        print(f"mujoco: {error}")
        return None
    data = mujoco.MjData(model)
    start, steps = time.thread_time(), 0
    while time.thread_time() - start < seconds:
        for _ in range(1000):
            mujoco.mj_step(model, data)
        mujoco.mj_resetData(model, data)
        steps += 1000
    return steps / (time.thread_time() - start)


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
    print(f"single environment, macro actions: {macro(seconds)['share']:.3f} of C++")
    own = mujoco_steps(seconds)
    if own is not None:
        ours = 20 * vector(20, seconds)["python_per_s"]
        print(
            f"physics steps a second: {ours:.0f} with control and sensing here, {own:.0f} bare mj_step by the package mujoco"
        )


if __name__ == "__main__":
    main()
