"""Laws of the planner from Python: policies are valid and cost what they say; bounds are bounds; walks of a policy end
with the hypothesis that was true; a problem of voxels is the problem of the file; callbacks, cancellation and bad input.
"""

from __future__ import annotations

import json
import pickle
import threading

import numpy as np
import pytest

import feeler


def test_results_have_the_keys_of_the_command_line(plug):
    result = feeler.solve(plug, extents=(3, 3, 3))
    assert result.status in ("gap", "converged")
    assert result["ratio"] == result.ratio == result.expected_cost / result.lower_bound <= 1.2
    for key in ("status", "expected_cost", "lower_bound", "ratio", "expansions", "cpu_s", "wall_s", "policy_nodes"):
        assert key in result
    assert result.policy_nodes == len(result.policy)
    with pytest.raises(AttributeError, match="no field"):
        _ = result.nonsense


def test_a_policy_costs_what_it_says_and_finds_every_hypothesis(plug):
    policy = feeler.solve(plug, "4x3x2").policy
    evaluation = policy.evaluate()
    assert evaluation.valid and evaluation.expected_cost == pytest.approx(policy.expected_cost)
    assert evaluation.cost.shape == (24,) and evaluation.cost.mean() == pytest.approx(policy.expected_cost)
    for hypothesis in range(24):
        walk = policy.walk(hypothesis)
        assert list(walk[-1].hypotheses) == [hypothesis]
        sizes = [len(node.hypotheses) for node in walk]
        assert sizes[0] == 24 and sizes == sorted(sizes, reverse=True)
    leaves = [node for node in policy.nodes() if node.move is None]
    assert sum(node.probability for node in leaves) == pytest.approx(1.0)
    assert sorted(h for node in leaves for h in node.hypotheses) == list(range(24))


def test_bounds_close_and_a_callback_may_stop(plug):
    rows = []
    feeler.solve(plug, (5, 5, 5), on_bounds=rows.append, gap=1.05)
    assert rows and all(row.lower_bound <= row.upper_bound * (1 + 1e-12) for row in rows)
    assert [row.lower_bound for row in rows] == sorted(row.lower_bound for row in rows)
    stopped = feeler.solve(plug, (9, 9, 9), gap=1.0, on_bounds=lambda row: False)
    assert stopped.status == "cancelled"
    with pytest.raises(ZeroDivisionError):
        feeler.solve(plug, (5, 5, 5), on_bounds=lambda row: 1 / 0)


def test_cancellation_from_another_thread(plug):
    cancellation = feeler.Cancellation()
    threading.Timer(0.05, cancellation.cancel).start()
    result = feeler.solve(plug, (15, 15, 15), gap=1.0, heuristic="lines", cancellation=cancellation)
    assert result.status in ("cancelled", "converged")


def test_contact_maps_are_arrays(plug):
    contact_map = plug.contact_map()
    travel = contact_map.travel("-z")
    assert travel.shape == contact_map.blocked().shape == contact_map.shape
    assert (travel[contact_map.blocked()] == 0).all() and 0 <= contact_map.margin_cells <= 0.5
    # If a step is free, what is left of the travel is one cell less.
    free = (travel[:, :, 1:] >= 1) & (travel[:, :, 1:] < 1e8)
    assert np.allclose(travel[:, :, 1:][free] - 1, travel[:, :, :-1][free], atol=1e-3)


VOXELS = {"size": (6, 6, 4), "start": (0, 0, 3), "hypotheses": [[2, 2, 0], [3, 2, 0], [2, 3, 0], [3, 3, 0]]}


def voxel_problem(**changes):
    return feeler.lattice_problem(np.ones((1, 1, 1), bool), np.ones((2, 2, 2), bool), **{**VOXELS, **changes})


def test_voxels_make_a_problem(tmp_path):
    problem = voxel_problem()
    # An oracle of its own: the tool is one cell; it is blocked where a cell of the target lies.
    cells = {tuple(np.array(h) + c) for h in VOXELS["hypotheses"][:1] for c in np.ndindex(2, 2, 2)}
    robot, travelled = np.array([2, 2, 3]), 0
    while tuple(robot - [0, 0, travelled + 1]) not in cells:
        travelled += 1
    assert problem.outcome(robot, "-z", 3, 0) == (travelled, True)
    result = feeler.solve(problem, gap=1.0)
    assert result.status == "converged" and result.ratio == 1.0 and result.policy.evaluate().valid
    path = tmp_path / "problem.json"
    path.write_text(
        json.dumps(
            {
                "name": "voxels", "size": [6, 6, 4], "start": [0, 0, 3], "tool": [[0, 0, 0]],
                "target": [list(c) for c in np.ndindex(2, 2, 2)], "hypotheses": [[*h, 1.0] for h in VOXELS["hypotheses"]],
                "move_lengths": [1, 2, 4, 8, 16], "cost": {"per_cell": 1, "per_contact": 0, "per_action": 0},
            }
        )
    )  # fmt: skip
    assert feeler.solve(feeler.read_problem(path), gap=1.0).expected_cost == result.expected_cost


def test_beliefs_split_by_outcomes(plug):
    problem = plug.problem((3, 3, 1))
    parts = problem.split(problem.start, "-z", 16)
    assert sorted(i for part in parts.values() for i in part) == list(range(9))


def test_policies_are_drawn_saved_and_graphs(plug, tmp_path):
    policy = feeler.solve(plug, (2, 2, 2)).policy
    assert policy.draw().startswith("digraph") and "<svg" in policy.draw("html")
    policy.save(tmp_path / "policy.json")
    assert json.loads((tmp_path / "policy.json").read_text()) == policy.to_dict()
    networkx = pytest.importorskip("networkx")
    graph = policy.to_networkx()
    assert networkx.is_arborescence(graph) and len(graph) == len(policy.nodes())


def test_databases(database, plug, tmp_path):
    stored = feeler.Database(database)
    assert len(stored) == 8 and stored.info().solved == 8 and (3, 3, 3) in stored and (4, 4, 4) not in stored
    assert [row.extents for row in stored] == sorted(row.extents for row in stored)
    row = stored.get((3, 2, 3))
    assert row.policy.evaluate().expected_cost == pytest.approx(row.expected_cost)
    assert stored.get((9, 9, 9)) is None
    verification = stored.verify()
    assert verification.faults == 0 and verification.policies == 8
    again = feeler.preprocess(plug, database, "2..3x2..3x2..3")
    assert again.skipped == 8 and again.complete == 0


def test_halves_merge_into_the_whole(database, plug, tmp_path):
    for name, family in (("a", "2x2..3x2..3"), ("b", "3x2..3x2..3")):
        feeler.preprocess(plug, tmp_path / f"{name}.db", family)
    assert feeler.merge([tmp_path / "a.db", tmp_path / "b.db"], tmp_path / "whole.db") == 8
    assert feeler.Database(tmp_path / "whole.db").digest() == feeler.Database(database).digest()
    feeler.preprocess("round-peg", tmp_path / "c.db", [(2, 2, 2)])
    with pytest.raises(feeler.InputError):
        feeler.merge([tmp_path / "a.db", tmp_path / "c.db"], tmp_path / "mixed.db")


def test_preprocessing_stops_and_resumes(plug, tmp_path):
    path = tmp_path / "part.db"
    first = feeler.preprocess(plug, path, "2..3x2..3x2..3", progress=lambda done, total: done < 3)
    assert first.cancelled and 0 < first.info.problems < 8
    second = feeler.preprocess(plug, path, "2..3x2..3x2..3")
    assert second.skipped == first.info.problems and second.info.problems == 8


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda: feeler.load_task("nothing-here"), "nothing-here"),
        (lambda: feeler.load_task("plug", opening="ajar"), "ajar"),
        (lambda: feeler.load_task("plug", goal="win"), "win"),
        (lambda: feeler.load_task("plug", cost="money"), "money"),
        (lambda: feeler.solve("plug"), "extents"),
        (lambda: feeler.solve("plug", (3, 3)), "axes|counts"),
        (lambda: feeler.solve("plug", (99, 3, 3)), "99"),
        (lambda: feeler.solve("plug", object()), "counts"),
        (lambda: feeler.solve(3, (3, 3, 3)), "type int"),
        (lambda: feeler.solve("plug", (3, 3, 3), epsilon=0.5), "epsilon"),
        (lambda: feeler.solve("plug", (3, 3, 3), gap=float("nan")), "gap"),
        (lambda: feeler.solve("plug", (3, 3, 3), solver="magic"), "magic"),
        (lambda: feeler.solve("plug", (3, 3, 3), speed=3), "unknown option"),
        (lambda: feeler.solve("plug", (3, 3, 3), jobs=0), "jobs"),
        (lambda: feeler.solve("plug", (3, 3, 3), jobs="two"), "jobs: str"),
        (lambda: feeler.solve("plug", (3, 3, 3), cancellation=3), "cancellation: int"),
        (lambda: feeler.load_task("plug").problem(None), "extents: NoneType"),
        (lambda: voxel_problem().outcome([0, 0], "-z", 3, 0), "outcome"),
        (lambda: voxel_problem().outcome([0, 0, 3], "down", 3, 0), "down"),
        (lambda: voxel_problem().contact_map.travel("-z", "first"), "orientation: str"),
        (lambda: feeler.solve(voxel_problem()).policy.walk("first"), "first"),
        (lambda: feeler.preprocess("plug", "never.db", "2x2x2", jobs=2000), "jobs"),
        (lambda: feeler.solve("plug", (3, 3, 3), gap="wide"), "wrong type"),
        (lambda: feeler.solve(voxel_problem(), (3, 3, 3)), "extents"),
        (lambda: voxel_problem(hypotheses=[[0.5, 0, 0]]), "whole"),
        (lambda: voxel_problem(hypotheses=[[2, 2, 0], [2, 2, 0]]), "hypothes"),
        (lambda: voxel_problem(weights=[1.0]), "weights"),
        (lambda: voxel_problem(weights=[1.0, float("nan"), 1.0, 1.0]), "weight|NaN|JSON|number"),
        (lambda: voxel_problem(start=(9, 9, 9)), "start"),
        (lambda: feeler.lattice_problem(np.ones((2, 2)), np.ones((1, 1, 1), bool), **VOXELS), "tool"),
        (lambda: feeler.Database("/no/such.db"), "such"),
        (lambda: feeler.Database(None), "path: is of type NoneType"),
        (lambda: feeler.load_task(3), "task: is of type int"),
        (lambda: feeler.load_task("plug", opening=None), "Task"),
        (lambda: feeler.merge(None, "out.db"), "paths: is of type NoneType"),
        (lambda: feeler.merge("a.db", "out.db"), "paths: is of type str"),
        (lambda: feeler.merge([None], "out.db"), "paths: is of type NoneType"),
        (lambda: feeler.preprocess("plug", None, "2x2x2"), "out: is of type NoneType"),
        (lambda: feeler.preprocess("plug", "never.db", 3), "family: is of type int"),
        (lambda: feeler.read_problem(None), "path: is of type NoneType"),
        (lambda: feeler.read_records(3), "path: is of type int"),
        (lambda: feeler.report(None, "out.html"), "folder: is of type NoneType"),
        (lambda: feeler.experiment("noise", None), "out: is of type NoneType"),
        (lambda: feeler.perceive("plug", cloud=np.ones((3, 3)), eye_m=(0, 0, 1), table=3), "table: is of type int"),
        (lambda: feeler.merge([], "out.db"), "no database"),
    ],
)
def test_bad_input_is_one_sentence(call, what):
    with pytest.raises(feeler.InputError, match=what) as caught:
        call()
    assert "\n" not in str(caught.value) and isinstance(caught.value, ValueError)


def test_results_are_plain_data(plug):
    row = next(iter(plug.axes))
    assert pickle.loads(pickle.dumps(row)) == row and json.loads(json.dumps(row)) == row
