"""A robot of one's own in Python: the executor drives it, and the episodes are those of C++, bit for bit.

    v/bin/python python/examples/own_robot.py [EPISODES]

``LoggingRobot`` stands where the driver of a real arm would: every motion of the executor comes by. Here it hands them to
the simulated arm; a driver would hand them to a controller and answer with what was measured.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

import feeler


class LoggingRobot(feeler.ForwardingRobot):
    """Counts the motions that it is asked for."""

    asked: Counter[str] = Counter()

    def transfer(self, world_T_tool):
        self.asked["transfer"] += 1
        return super().transfer(world_T_tool)

    def linear_move(self, world_T_tool, speed_m_s, contact_force_n):
        self.asked["linear_move"] += 1
        return super().linear_move(world_T_tool, speed_m_s, contact_force_n)

    def guarded(self, direction, distance_m, speed_m_s, contact_force_n):
        self.asked["guarded"] += 1
        return super().guarded(direction, distance_m, speed_m_s, contact_force_n)


def without_times(record: dict) -> dict:
    """What does not depend on the machine."""
    return {key: value for key, value in record.items() if key not in ("timing", "replay")}


def main(episodes: int = 50) -> int:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plug.db"
        feeler.preprocess("plug", path, "2..4x2..4x2..4")
        ours = feeler.run("plug", database=path, episodes=episodes, seed=7)
        theirs = feeler.run("plug", database=path, episodes=episodes, seed=7, robot=LoggingRobot)
    same = sum(without_times(a) == without_times(b) for a, b in zip(ours.records, theirs.records, strict=True))
    print(f"{theirs.inserted} of {episodes} inserted; motions asked of Python: {dict(LoggingRobot.asked)}")
    print(f"{same} of {episodes} episodes equal those of C++ bit for bit")
    return 0 if same == episodes else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:2])))
