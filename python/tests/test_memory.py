"""Resets, steps and environments leave nothing behind: after a warm-up, resident memory stays where it is. The long form,
10,000 resets and 10^6 control steps, is python/bench/memory.py.
"""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "bench/memory.py"))


@pytest.mark.parametrize(
    ("what", "count", "limit_bytes"), [("resets", 250, 2e6), ("steps", 25_600, 2e6), ("environments", 30, 4e6)]
)
def test_nothing_is_left_behind(what, count, limit_bytes):
    assert BENCH[what](count) < limit_bytes


def test_the_measure_sees_a_leak():
    kept: list[bytearray] = []
    assert BENCH["growth"](lambda: kept.append(bytearray(b"x") * 2_000_000), 5, 30) > 30e6
