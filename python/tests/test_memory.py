"""Resets, steps and environments leave nothing behind: after a warm-up, resident memory stays where it is. In processes of
their own: memory that other tests gave back would hide a leak. The long form, 10,000 resets and 10^6 control steps, is
python/bench/memory.py without arguments.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

BENCH = Path(__file__).parents[1] / "bench/memory.py"


def test_nothing_is_left_behind():
    command = [
        sys.executable,
        BENCH,
        "--resets",
        "500",
        "--steps",
        "50000",
        "--environments",
        "30",
        "--limit-kb",
        "2000",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_measure_sees_a_leak():
    code = """
import runpy, sys
import feeler
bench, kept = runpy.run_path(sys.argv[1]), []
env = feeler.InsertionEnv("plug")

def reset():
    env.reset(seed=1)
    kept.append(bytearray(b"x") * 100_000)

sys.exit(0 if bench["growth"](reset, 50, 100) > 5e6 else 1)
"""
    assert subprocess.run([sys.executable, "-c", code, BENCH]).returncode == 0
