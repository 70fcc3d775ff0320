"""Laws of signals: Ctrl-C in long work raises KeyboardInterrupt, keeps what is done, and the process lives; what another
handler raises comes out as it is. The signal is sent from inside of the work, to a process of its own.
"""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

HEAD = """
import os, signal, sys
import numpy as np
import feeler

sent = []

def interrupt(*_):
    if not sent:
        sent.append(True)
        os.kill(os.getpid(), signal.SIGINT)

def expect(work, error=KeyboardInterrupt):
    try:
        work()
    except error:
        print("raised", flush=True)
    else:
        print("went through")

def alive():
    assert feeler.solve("plug", (2, 2, 2)).policy.evaluate().valid
    print("alive")
"""

WORK = {
    "solve": """
        expect(lambda: feeler.solve("plug", (15, 15, 15), gap=1.0, heuristic="lines", on_bounds=interrupt))
    """,
    "preprocess": """
        path = sys.argv[1]
        expect(lambda: feeler.preprocess("plug", path, "2..9x2..9x2..9", progress=interrupt))
        left = len(feeler.Database(path))
        assert 0 < left < 512, left
        database = feeler.Database(path)
        assert database.verify().faults == 0 and database.info().problems == left
    """,
    "run": """
        records = []
        def take(record):
            records.append(record)
            interrupt()
        expect(lambda: feeler.run("plug", "spiral", episodes=1000, on_record=take))
        assert 0 < len(records) < 1000
    """,
    "export": """
        expect(lambda: feeler.export_episodes(sys.argv[1], "plug", "spiral", episodes=1000, format="npz", progress=interrupt))
        assert not os.path.exists(sys.argv[1])
    """,
    "execute": """
        import time
        class Slow(feeler.Robot):
            pose, calls = np.eye(4), 0
            def tool_pose(self): return self.pose
            def contact_wrench(self): return np.zeros(6)
            def zero_wrench(self): pass
            def time(self): return 0.0
            def transfer(self, world_T_tool):
                self.pose = world_T_tool
                return feeler.MotionResult("reached", 0.0, False, 0.0, world_T_tool)
            def linear_move(self, world_T_tool, speed_m_s, contact_force_n):
                Slow.calls += 1
                interrupt()
                time.sleep(0.2)
                return self.transfer(world_T_tool)
            def guarded(self, *_): raise NotImplementedError
            def compliant(self, *_): raise NotImplementedError
        class UpAndDown(feeler.Policy):
            name, up = "up and down", False
            def next(self, belief):
                self.up = not self.up
                return feeler.Move("+z" if self.up else "-z", 1)
            def observe(self, cells, contact): return True
        expect(lambda: feeler.execute("plug", (2, 2, 2), np.eye(4), UpAndDown(), Slow()))
        assert 0 < Slow.calls < 300, Slow.calls  # left alone: 399
    """,
    "experiment": """
        expect(lambda: feeler.experiment("bounds", sys.argv[1], quick=True, progress=interrupt))
    """,
}


def in_a_process(code, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", HEAD + textwrap.dedent(code) + "\nalive()\n", str(tmp_path / "made")],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("what", WORK)
def test_ctrl_c_stops_long_work(what, tmp_path):
    assert in_a_process(WORK[what], tmp_path) == ["raised", "alive"]


def test_what_a_handler_raises_comes_out(tmp_path):
    code = """
        class Alarm(Exception): pass
        def handler(*_): raise Alarm
        signal.signal(signal.SIGUSR1, handler)
        def send(*_):
            if not sent:
                sent.append(True)
                os.kill(os.getpid(), signal.SIGUSR1)
        expect(lambda: feeler.solve("plug", (15, 15, 15), gap=1.0, heuristic="lines", on_bounds=send), Alarm)
    """
    assert in_a_process(code, tmp_path) == ["raised", "alive"]


def test_a_handler_that_raises_nothing_stops_nothing(tmp_path):
    code = """
        signal.signal(signal.SIGUSR1, lambda *_: None)
        send = lambda *_: os.kill(os.getpid(), signal.SIGUSR1)
        assert feeler.solve("plug", (5, 5, 5), on_bounds=send).status in ("gap", "converged")
    """
    assert in_a_process(code, tmp_path) == ["alive"]
