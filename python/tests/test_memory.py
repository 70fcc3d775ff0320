"""Resets and steps leave nothing behind: after a warm-up, resident memory stays where it is.

FEELER_LEAK_SCALE=40 makes it 10,000 resets and 10^6 steps.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path

import numpy as np

import feeler

SCALE = float(os.environ.get("FEELER_LEAK_SCALE", "1"))


def resident_mb() -> float:
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def growth(work, warm: int, rounds: int) -> float:
    for _ in range(warm):
        work()
    before = resident_mb()
    for _ in range(rounds):
        work()
    return resident_mb() - before


def test_resets_leak_nothing():
    env = feeler.InsertionEnv("plug")
    seeds = iter(range(10**9))
    assert growth(lambda: env.reset(seed=next(seeds)), 50, int(250 * SCALE)) < 2.0


def test_steps_leak_nothing():
    env = feeler.VectorInsertionEnv(16, "plug", threads=1, control_steps=1, time_limit_s=0.5)
    env.reset(seed=1)
    still = np.zeros((16, 6), dtype=np.float32)
    assert growth(lambda: env.step(still), 600, int(1600 * SCALE)) < 2.0


def test_environments_leak_nothing():
    def work():
        env = feeler.InsertionEnv("plug")
        env.reset(seed=1)
        env.close()

    assert growth(work, 20, int(30 * SCALE)) < 4.0
