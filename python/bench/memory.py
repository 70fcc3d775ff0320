"""Whether resets and steps leave anything behind: growth of resident memory after a warm-up.

v/bin/python python/bench/memory.py [--resets 10000] [--steps 1000000] [--environments 200] [--limit-kb 2000]
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import feeler


def resident_bytes() -> int:
    """Of this process, after the garbage collector."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def growth(work: Callable[[], object], warm: int, rounds: int) -> int:
    """Bytes by which memory grows in ``rounds`` calls that follow ``warm`` others."""
    for _ in range(warm):
        work()
    before = resident_bytes()
    for _ in range(rounds):
        work()
    return resident_bytes() - before


def resets(count: int, name: str = "plug") -> int:
    """Growth in bytes over so many resets of one environment, each with a seed of its own."""
    env = feeler.InsertionEnv(name)
    seeds = iter(range(10**9))
    return growth(lambda: env.reset(seed=next(seeds)), 50, count)


def steps(count: int) -> int:
    """Growth in bytes over so many control steps (1 ms each), by 16 environments that reset themselves every 0.5 s."""
    env = feeler.VectorInsertionEnv(16, "plug", threads=1, control_steps=1, time_limit_s=0.5)
    env.reset(seed=1)
    still = np.zeros((16, 6), dtype=np.float32)
    return growth(lambda: env.step(still), 600, -(-count // 16))


def environments(count: int) -> int:
    """Growth in bytes over so many environments, made, reset, stepped and closed."""

    def work() -> None:
        env = feeler.InsertionEnv("plug")
        env.reset(seed=1)
        env.step(np.zeros(6, dtype=np.float32))
        env.close()

    return growth(work, 20, count)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resets", type=int, default=10_000)
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--environments", type=int, default=200)
    parser.add_argument("--limit-kb", type=float, help="exit with 1 where something grew by more")
    a = parser.parse_args()
    largest = 0.0
    for name, work, count in (
        ("resets", resets, a.resets),
        ("control steps", steps, a.steps),
        ("environments made and closed", environments, a.environments),
    ):
        start = time.process_time()
        grown = work(count)
        largest = max(largest, grown / 1e3)
        print(f"{count:9d} {name}: {grown / 1e3:+.0f} kB, {time.process_time() - start:.0f} s of CPU", flush=True)
    return 1 if a.limit_kb is not None and largest > a.limit_kb else 0


if __name__ == "__main__":
    sys.exit(main())
