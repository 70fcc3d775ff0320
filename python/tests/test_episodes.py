"""Laws of episodes from Python: the records are those of C++ for any number of threads, whoever carries the motions out;
policies in Python stand beside the others; what a callback raises comes out; the session gives what execute gives.
"""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import feeler
from feeler.robot import MotionResult


def content(record):
    return {key: value for key, value in record.items() if key != "timing"}


class CertainFirst(feeler.Policy):
    """Follows a stored graph, in Python."""

    name = "certain-first"

    def __init__(self, nodes):
        self.nodes, self.at = nodes, 0

    def begin(self, problem):
        self.at = 0
        assert len(problem.hypotheses) == 27

    def next(self, belief):
        node = self.nodes[self.at]
        return feeler.Insert() if node.move is None else feeler.Move(*node.move)

    def observe(self, cells, contact):
        for branch in self.nodes[self.at].outcomes:
            if (branch[0], branch[1]) == (cells, contact):
                self.at = branch[2]
                return True
        return False


@pytest.fixture(scope="module")
def graph(plug):
    return feeler.solve(plug, (3, 3, 3)).policy


def test_summary_and_records(database):
    run = feeler.run("plug", database=database, episodes=4, seed=3)
    assert run.episodes == 4 and len(run.records) == 4 and run.inserted == sum(r.inserted for r in run.records)
    for key in (
        "localized",
        "inserted",
        "sim_time_median_s",
        "moves_mean",
        "path_length_mean_m",
        "plan_cpu_s",
        "failures",
    ):
        assert key in run
    later = feeler.run("plug", database=database, episodes=2, first=2, seed=3, jobs=2)
    assert [content(r) for r in later.records] == [content(r) for r in run.records[2:]]


def test_a_budget_and_a_wrist_make_contacts_gentler(database):
    """Half of the budget halves the peak, and takes longer; a tool on springs is gentler and no slower."""
    plain = feeler.run("plug", database=database, episodes=3, seed=3)
    gentle = feeler.run("plug", database=database, episodes=3, seed=3, force_budget=12)
    soft = feeler.run("plug", database=database, episodes=3, seed=3, force_budget=12, wrist_stiffness=15000)
    assert plain.inserted == gentle.inserted == soft.inserted == 3
    assert all(r.force_budget_n == 12 and r.peak_force_n <= 12 for r in (*gentle.records, *soft.records))
    assert max(r.peak_force_n for r in plain.records) > 12
    assert gentle.sim_time_median_s > plain.sim_time_median_s
    assert soft.sim_time_median_s < gentle.sim_time_median_s
    for wrong, words in (({"force_budget": 0}, "force_budget"), ({"wrist_stiffness": 10}, "stiffness of the wrist")):
        with pytest.raises(feeler.InputError, match=words):
            feeler.run("plug", database=database, **wrong)


def test_a_robot_in_python_gives_the_episodes_of_cpp(database):
    ours = feeler.run("plug", database=database, episodes=4, seed=5)
    theirs = feeler.run("plug", database=database, episodes=4, seed=5, robot=feeler.ForwardingRobot)
    assert [content(r) for r in ours.records] == [content(r) for r in theirs.records]


def test_a_policy_in_python_gives_the_episodes_of_its_graph(graph):
    theirs = feeler.run("plug", graph, extents=(3, 3, 3), episodes=3, seed=2)
    ours = feeler.run("plug", CertainFirst(graph.nodes()), extents=(3, 3, 3), episodes=3, seed=2, jobs=2)
    assert {r.policy for r in ours.records} == {"certain-first"}
    drop = ("policy", "timing")
    for a, b in zip(ours.records, theirs.records, strict=True):
        assert {k: v for k, v in a.items() if k not in drop} == {k: v for k, v in b.items() if k not in drop}


class Broken(feeler.ForwardingRobot):
    what = "raise"

    def guarded(self, *args):
        if self.what == "raise":
            raise LookupError("the cable is out")
        if self.what == "nonsense":
            return "all went well"
        result = super().guarded(*args)
        bad = result.world_T_tool.copy()
        bad[0, 3] = np.nan
        return MotionResult("reached", result.travelled_m, False, 0.0, bad)


@pytest.mark.parametrize(
    ("what", "error", "words"),
    [("raise", LookupError, "cable"), ("nonsense", feeler.InputError, "guarded"), ("nan", feeler.InputError, "finite")],
)
def test_a_broken_robot_is_an_exception(graph, what, error, words):
    broken = type("Broken", (Broken,), {"what": what})
    with pytest.raises(error, match=words):
        feeler.run("plug", graph, extents=(3, 3, 3), robot=broken)


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (lambda: 1 / 0, ZeroDivisionError),
        (lambda: "up", feeler.InputError),
        (lambda: feeler.Move("up", 1), feeler.InputError),
        (lambda: feeler.Move("+x", 0), feeler.InputError),
        (lambda: feeler.Move("+x", "far"), feeler.InputError),
        (lambda: feeler.Spiral(pitch_m=-1.0), feeler.InputError),
    ],
)
def test_a_broken_policy_is_an_exception(answer, error):
    class Wrong(feeler.Policy):
        def next(self, belief):
            return answer()

    with pytest.raises(error):
        feeler.run("plug", Wrong(), extents=(3, 3, 3))


def test_callbacks_stop_or_raise(database):
    stopped = feeler.run("plug", database=database, episodes=9, on_record=lambda record: record["episode"] < 1)
    assert 2 <= stopped.episodes < 9
    with pytest.raises(KeyError):
        feeler.run("plug", database=database, episodes=3, on_record=lambda record: record["nothing"])
    with pytest.raises(ZeroDivisionError):
        feeler.run("plug", database=database, episodes=3, progress=lambda done, total: 1 // 0)


def test_execute_and_session_say_the_same(plug, graph):
    def world():
        env = feeler.InsertionEnv("plug")
        env.reset(seed=4, options={"extents": [3, 3, 3], "start": "home"})
        return env

    env = world()
    direct = feeler.execute(plug, (3, 3, 3), env.core.world_T_estimate, graph, feeler.ForwardingRobot(env.robot))
    assert direct.inserted and env.judge()["inserted"]

    env = world()
    robot = env.robot
    with feeler.Session(plug, (3, 3, 3), env.core.world_T_estimate, graph, pose=robot.tool_pose()) as session:
        with pytest.raises(feeler.InputError, match="next"):
            session.report()
        motions = 0
        while (motion := session.next(timeout_s=60)) is not None:
            assert session.next() is motion
            result = getattr(robot, motion.kind)(**motion.arguments)
            session.report(result, wrench=robot.contact_wrench(), time_s=robot.time())
            motions += 1
        assert motions > 3 and content(session.verdict) == content(direct)


def test_a_session_can_be_given_up_and_says_what_is_wrong(plug, graph):
    session = feeler.Session(plug, (3, 3, 3), np.eye(4), graph, pose=np.eye(4))
    assert session.next(timeout_s=60).kind == "transfer"
    with pytest.raises(feeler.InputError, match="MotionResult"):
        session.report("done")
    session.close()
    session.close()
    wrong = feeler.Session(plug, (3, 3, 3), np.eye(3), graph, pose=np.eye(4))
    with pytest.raises(feeler.InputError, match="estimate"):
        wrong.next(timeout_s=60)


def test_a_graph_of_another_problem_is_refused(plug, graph, tmp_path):
    env = feeler.InsertionEnv("plug")
    env.reset(seed=4)
    for call in (
        lambda: feeler.run(plug, graph, extents=(3, 3, 2)),
        lambda: feeler.export_episodes(tmp_path / "x", plug, graph, extents=(3, 3, 2)),
        lambda: feeler.execute(plug, (3, 3, 2), np.eye(4), graph, feeler.ForwardingRobot(env.robot)),
    ):
        with pytest.raises(feeler.InputError, match="another problem"):
            call()


def test_reports_are_checked_and_an_open_session_ends_with_the_process(plug, graph):
    with pytest.raises(feeler.InputError, match="pose"):
        feeler.Session(plug, (3, 3, 3), np.eye(4), graph, pose=np.eye(3))
    with feeler.Session(plug, (3, 3, 3), np.eye(4), graph, pose=np.eye(4)) as session:
        motion = session.next(timeout_s=60)
        result = MotionResult("reached", 0.0, False, 0.0, motion.arguments["world_T_tool"])
        for bad in ({"wrench": [1, 2]}, {"wrench": [np.nan] * 6}, {"time_s": "now"}):
            with pytest.raises(feeler.InputError, match="finite"):
                session.report(result, **bad)
        assert session.next() is motion
        session.report(result, wrench=np.zeros(6), time_s=1.0)
    code = """
import numpy as np, feeler
policy = feeler.solve("plug", (2, 2, 2)).policy
session = feeler.Session("plug", (2, 2, 2), np.eye(4), policy, pose=np.eye(4))
print(session.next(timeout_s=60).kind)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stdout, done.stderr) == (0, "transfer\n", "")


def test_frames_and_files(database, tmp_path):
    run = feeler.run("plug", database=database, episodes=2)
    run.save(tmp_path / "run.jsonl")
    again = feeler.read_records(tmp_path / "run.jsonl")
    assert again.episodes == 2 and again.records == run.records
    pytest.importorskip("pandas")
    frame = run.to_pandas()
    assert (
        len(frame) == 2
        and "error.lateral_m" in frame
        and frame["inserted"].tolist() == [r.inserted for r in run.records]
    )


@pytest.mark.parametrize(
    ("kwargs", "what"),
    [
        ({"policy": "magic"}, "magic"),
        ({"policy": 3}, "type int"),
        ({"policy": "spiral", "episodes": 0}, "episodes"),
        ({"policy": "spiral", "jobs": -1}, "jobs"),
        ({"policy": "spiral", "seed": 1.5}, "seed: float"),
        ({"policy": "spiral", "ladder": "high"}, "ladder: str"),
        ({"policy": "spiral", "noise": "earthquake"}, "earthquake"),
        ({"policy": "spiral", "placement": "moon"}, "moon"),
        ({"policy": "spiral", "policy_options": {"colour": "red"}}, "colour"),
        ({"policy": "database"}, "database"),
        ({"policy": "spiral", "extents": (1,)}, "axes|counts"),
    ],
)
def test_bad_requests_are_one_sentence(kwargs, what):
    with pytest.raises(feeler.InputError, match=what) as caught:
        feeler.run("plug", **kwargs)
    assert "\n" not in str(caught.value)
