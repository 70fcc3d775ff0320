"""Laws of exported episodes: every observation lies in the space; played back as actions of the environment they lead where
the expert went; beliefs only shrink; files give back what went in; Minari loads its data set.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

import feeler
from feeler import spaces


@pytest.fixture(scope="module")
def npz(database, tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "expert.npz"
    return path, feeler.export_episodes(path, "plug", database=database, episodes=2, seed=3)


def test_rows_lie_in_the_spaces(npz):
    _, data = npz
    space, actions = spaces.flat_observation_space(), spaces.action_space("control")
    assert len(data) == 2 and data.starts[-1] == len(data.observations)
    assert all(space.contains(row) for row in data.observations) and all(actions.contains(row) for row in data.actions)
    assert data.rewards.sum() == sum(r.inserted for r in data.records)
    # Contacts are told, however short: the policy's own, and the bottom of the opening.
    assert all(data.contact[data.episode(k)].any() for k in range(len(data)))


def test_actions_lead_to_the_next_row(npz):
    _, data = npz
    rows = data.episode(0)
    seen, actions, clipped = data.observations[rows], data.actions[rows].astype(float), data.clipped[rows]
    moved = seen[:-1, 12:15] + actions[:-1, :3] * data.settings["max_displacement_m"]
    assert np.abs(moved - seen[1:, 12:15])[~clipped[:-1]].max() < 1e-8


def test_beliefs_shrink(npz):
    _, data = npz
    for k in range(len(data)):
        left = data.hypotheses_left[data.episode(k)]
        assert left[0] == np.prod(data.records[k].extents) and (np.diff(left) <= 0).all()
        assert left[-1] == 1 or data.records[k].ladder


def test_episodes_are_those_of_run(npz, database):
    _, data = npz
    run = feeler.run("plug", database=database, episodes=2, seed=3)
    for a, b in zip(run.records, data.records, strict=True):
        assert a.moves == b.moves and a.inserted == b.inserted


def test_npz_gives_back(npz):
    path, data = npz
    again = feeler.load_npz(path)
    assert np.array_equal(again.observations, data.observations) and np.array_equal(again.starts, data.starts)
    assert again.settings == data.settings and again.records[0].reason == data.records[0].reason


def test_lerobot_schema(database, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = tmp_path / "set"
    data = feeler.export_episodes(folder, "plug", database=database, episodes=1, seed=3, format="lerobot")
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["codebase_version"] == "v2.1" and info["total_frames"] == len(data.observations) and info["fps"] == 50
    table = parquet.read_table(folder / info["data_path"].format(episode_chunk=0, episode_index=0))
    assert set(table.column_names) == set(info["features"]) and table.num_rows == len(data.observations)
    states = np.array(table["observation.state"].to_pylist())
    assert np.allclose(states, data.observations, atol=1e-3)
    with pytest.raises(feeler.InputError, match="there already"):
        feeler.export_episodes(folder, "plug", database=database, format="lerobot")


def test_minari_loads(database, tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    minari = pytest.importorskip("minari")
    data = feeler.export_episodes(
        "feeler/plug/expert-v0", "plug", database=database, episodes=2, seed=3, format="minari"
    )
    loaded = minari.load_dataset("feeler/plug/expert-v0")
    assert loaded.total_episodes == 2
    first = next(iter(loaded.iterate_episodes()))
    assert np.array_equal(first.observations, data.observations[data.episode(0)])
    assert np.array_equal(first.actions, data.actions[data.episode(0)][:-1])
    assert first.terminations[-1] == data.records[0].inserted


def test_unknown_formats_are_refused(tmp_path):
    with pytest.raises(feeler.InputError, match="xml"):
        feeler.export_episodes(tmp_path / "x", format="xml")
