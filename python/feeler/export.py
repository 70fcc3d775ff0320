"""Labelled expert episodes at control rate, for learners."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import __version__, _feeler
from .database import Database
from .episodes import given_policy
from .errors import input_error, one_sentence
from .planner import Cancellation, Extents, PolicyGraph, Progress, Task, as_task
from .policy import Policy
from .results import Result
from .spaces import components

MOTIONS: tuple[str, ...] = tuple(_feeler.MOTIONS)


@dataclass
class Demonstrations:
    """Episodes one after the other; episode k has rows ``starts[k]`` to ``starts[k + 1]`` (exclusive).

    Attributes:
        observations: (rows, 33) float64, as ``feeler/Insertion-v0`` observes.
        actions: (rows, 6) float32: where the tool went until the next row, as actions of ``feeler/Insertion-v0`` (shares of
            ``max_displacement_m`` and ``max_turn_rad``; quicker motions are cut to length, ``clipped`` says where).
        rewards: (rows,): 1 in the last row of an episode that inserted.
        terminated, truncated: (rows,) bool.
        times_s: (rows,): since the reset.
        contact: (rows,) bool: the contact force exceeded 5 N since the row before.
        motions: (rows,): which kind of motion of the executor was under way, index into ``MOTIONS``.
        hypotheses_left: (rows,): how many were possible when the action was taken.
        records: of the episodes.
    """

    observations: NDArray[np.float64]
    actions: NDArray[np.float32]
    clipped: NDArray[np.bool_]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    times_s: NDArray[np.float64]
    contact: NDArray[np.bool_]
    motions: NDArray[np.uint8]
    hypotheses_left: NDArray[np.int64]
    starts: NDArray[np.int64]
    records: list[Result]
    settings: dict[str, Any]

    def __len__(self) -> int:
        return len(self.starts) - 1

    def episode(self, number: int) -> slice:
        """The rows of an episode."""
        return slice(int(self.starts[number]), int(self.starts[number + 1]))


def _turns(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation vectors (world axes) from each orientation (w, x, y, z) to the next; zero after the last."""
    a, b = quaternions[:-1], quaternions[1:]
    # b * conj(a)
    w = np.sum(a * b, axis=1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(b[:, 1:], a[:, 1:])
    v, w = np.where(w[:, None] < 0, -v, v), np.abs(w)
    size = np.linalg.norm(v, axis=1)
    scale = np.where(size > 1e-12, 2 * np.arctan2(size, w) / np.maximum(size, 1e-300), 2.0)
    return np.vstack([v * scale[:, None], np.zeros((1, 3))])


def _left(track: dict[str, Any], begun_s: float) -> NDArray[np.int64]:
    """Hypotheses that were left at each time."""
    times_s = track["times_s"]
    left = np.full(len(times_s), int(np.prod(track["record"]["extents"])), dtype=np.int64)
    for since_s, count in track["decisions"]:
        left[times_s >= begun_s + since_s] = count
    return left


@one_sentence
def record(
    task: Task | str = "plug",
    policy: str | PolicyGraph | Policy = "database",
    *,
    database: Database | str | os.PathLike[str] | None = None,
    episodes: int = 10,
    first: int = 0,
    seed: int = 1,
    extents: Extents | None = None,
    noise: str = "ideal",
    control_steps: int = 20,
    max_displacement_m: float = 0.002,
    max_turn_rad: float = 0.01,
    cancellation: Cancellation | None = None,
    progress: Progress | None = None,
) -> Demonstrations:
    """Runs episodes as :func:`feeler.run` does and keeps a row every ``control_steps`` ms from the start pose on."""
    loaded = as_task(task)
    if isinstance(database, str | os.PathLike):
        database = Database(database)
    given = given_policy(policy, loaded, extents)
    tracks = _feeler.record_tracks(
        loaded._core, given, None if database is None else database._core, first, episodes, seed, extents, noise,
        control_steps, cancellation, progress,
    )  # fmt: skip
    parts: dict[str, list[Any]] = {key: [] for key in (
        "observations", "actions", "clipped", "rewards", "terminated", "truncated", "times_s", "contact", "motions", "left")}  # fmt: skip
    starts, records = [0], []
    for track in tracks:
        seen, times_s = track["observations"], track["times_s"]
        if len(seen) < 2:
            continue
        steps = np.vstack([np.diff(seen[:, 12:15], axis=0), np.zeros((1, 3))]) / max_displacement_m
        turns = _turns(seen[:, 15:19]) / max_turn_rad
        sizes = np.stack([np.linalg.norm(steps, axis=1), np.linalg.norm(turns, axis=1)], axis=1)
        longest = np.maximum(sizes, 1.0)
        parts["actions"].append(np.hstack([steps / longest[:, :1], turns / longest[:, 1:]]).astype(np.float32))
        parts["clipped"].append((sizes > 1.0).any(axis=1))
        contact = track["contact"].astype(bool)
        seen = seen.copy()
        seen[:, 31] = np.linalg.norm(seen[:, 19:22], axis=1) > 5.0
        parts["observations"].append(seen)
        last = np.zeros(len(seen), dtype=bool)
        last[-1] = True
        inserted = bool(track["record"]["inserted"])
        parts["rewards"].append(np.where(last & inserted, 1.0, 0.0))
        parts["terminated"].append(last & inserted)
        parts["truncated"].append(last & (not inserted))
        parts["times_s"].append(times_s)
        parts["contact"].append(contact)
        parts["motions"].append(track["motions"])
        parts["left"].append(_left(track, float(times_s[0])))
        starts.append(starts[-1] + len(seen))
        records.append(Result(track["record"]))
    if not records:
        raise input_error("export", "no episode came to the start pose", "see feeler.run(...).records for the reasons")
    joined = {key: np.concatenate(value) for key, value in parts.items()}
    settings = {
        "task": loaded.argument,
        "policy": policy if isinstance(policy, str) else getattr(policy, "name", "graph"),
        "seed": seed,
        "noise": noise,
        "control_steps": control_steps,
        "max_displacement_m": max_displacement_m,
        "max_turn_rad": max_turn_rad,
        "version": __version__,
    }
    joined["hypotheses_left"] = joined.pop("left")
    return Demonstrations(**joined, starts=np.array(starts), records=records, settings=settings)


@one_sentence
def export_episodes(
    out: str | os.PathLike[str], task: Task | str = "plug", policy: str | PolicyGraph | Policy = "database", *,
    format: str = "npz", **how: Any,
) -> Demonstrations:  # fmt: skip
    """Records expert episodes (arguments as :func:`record`) and writes them.

    Args:
        out: ``"npz"``: the file. ``"lerobot"``: a folder that is not there yet, schema v2.1. ``"minari"``: the id of the
            data set, e.g. ``"feeler/plug/expert-v0"``; it goes where Minari keeps its data (``MINARI_DATASETS_PATH``).
        format: ``"npz"``, ``"lerobot"`` (needs pyarrow), ``"minari"`` (needs minari).
    """
    writers = {"npz": save_npz, "lerobot": save_lerobot, "minari": save_minari}
    if format not in writers:
        raise input_error("format", f'unknown format "{format}"', f"choose from {', '.join(writers)}")
    if format == "lerobot" and Path(out).exists():
        raise input_error("out", f"{os.fspath(out)} is there already", "give a new folder")
    data = record(task, policy, **how)
    writers[format](data, out)
    return data


_ARRAYS = ("observations", "actions", "clipped", "rewards", "terminated", "truncated", "times_s", "contact", "motions",
           "hypotheses_left", "starts")  # fmt: skip


def save_npz(data: Demonstrations, path: str | os.PathLike[str]) -> None:
    """One compressed file of numpy arrays, names as the fields; records and settings as JSON text."""
    arrays = {name: getattr(data, name) for name in _ARRAYS}
    partial = f"{os.fspath(path)}.part"
    with open(partial, "wb") as file:
        np.savez_compressed(
            file, allow_pickle=False, records=json.dumps(data.records), settings=json.dumps(data.settings), **arrays
        )
    os.replace(partial, path)


def load_npz(path: str | os.PathLike[str]) -> Demonstrations:
    """What :func:`save_npz` wrote."""
    with np.load(path) as file:
        arrays = {name: file[name] for name in _ARRAYS}
        records = [Result(r) for r in json.loads(str(file["records"]))]
        return Demonstrations(**arrays, records=records, settings=json.loads(str(file["settings"])))


def save_minari(data: Demonstrations, dataset_id: str | os.PathLike[str]) -> None:
    """A Minari data set. The last row of an episode is its last observation: it has no action."""
    import gymnasium
    import minari
    from minari.data_collector import EpisodeBuffer

    settings = data.settings
    env = gymnasium.make(
        "feeler/Insertion-v0",
        **{k: settings[k] for k in ("task", "control_steps", "max_displacement_m", "max_turn_rad")},
    )
    buffers = []
    for k in range(len(data)):
        rows = data.episode(k)
        steps = slice(rows.start, rows.stop - 1)
        after = slice(rows.start + 1, rows.stop)
        buffers.append(
            EpisodeBuffer(
                id=k,
                seed=settings["seed"],
                observations=list(data.observations[rows]),
                actions=list(data.actions[steps]),
                rewards=data.rewards[after].tolist(),
                terminations=data.terminated[after].tolist(),
                truncations=data.truncated[after].tolist(),
                infos={
                    "contact": data.contact[rows].copy(),
                    "hypotheses_left": data.hypotheses_left[rows].copy(),
                    "motion": data.motions[rows].copy(),
                },
            )
        )
    minari.create_dataset_from_buffers(
        dataset_id=os.fspath(dataset_id),
        buffer=buffers,
        env=env,
        algorithm_name=f"feeler {settings['policy']}",
        author="feeler",
        author_email="feeler@example.org",
        code_permalink="https://example.org/feeler",
        description=f"Insertions localized by touch: {json.dumps(settings)}",
    )


def save_lerobot(data: Demonstrations, folder: str | os.PathLike[str]) -> None:
    """A folder in LeRobot's schema v2.1: ``meta/*.json(l)`` and a Parquet file an episode."""
    import pyarrow
    import pyarrow.parquet

    root = Path(folder)
    (root / "meta").mkdir(parents=True)
    (root / "data" / "chunk-000").mkdir(parents=True)
    fps = 1000 / data.settings["control_steps"]
    task = f"insert: {data.settings['task']}"
    states = [row[0] for row in components()]
    axes = ["dx", "dy", "dz", "rx", "ry", "rz"]

    def feature(dtype: str, shape: list[int], names: list[str] | None = None) -> dict[str, Any]:
        return {"dtype": dtype, "shape": shape, "names": names}

    features = {
        "observation.state": feature("float32", [len(states)], states),
        "action": feature("float32", [len(axes)], axes),
        "next.reward": feature("float32", [1]),
        "next.done": feature("bool", [1]),
        "observation.contact": feature("bool", [1]),
        "observation.hypotheses_left": feature("int64", [1]),
        **{name: feature("float32" if name == "timestamp" else "int64", [1])
           for name in ("timestamp", "frame_index", "episode_index", "index", "task_index")},
    }  # fmt: skip
    episodes, stats = [], []
    for k in range(len(data)):
        rows = data.episode(k)
        n = rows.stop - rows.start
        frame = np.arange(n)
        columns: dict[str, Any] = {
            "observation.state": data.observations[rows].astype(np.float32),
            "action": data.actions[rows],
            "next.reward": data.rewards[rows].astype(np.float32),
            "next.done": data.terminated[rows] | data.truncated[rows],
            "observation.contact": data.contact[rows],
            "observation.hypotheses_left": data.hypotheses_left[rows],
            "timestamp": (frame / fps).astype(np.float32),
            "frame_index": frame,
            "episode_index": np.full(n, k),
            "index": frame + rows.start,
            "task_index": np.zeros(n, dtype=np.int64),
        }
        table = pyarrow.table({
            name: pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(values.reshape(-1)), values.shape[1])
            if values.ndim == 2 else pyarrow.array(values)
            for name, values in columns.items()
        })  # fmt: skip
        pyarrow.parquet.write_table(table, root / "data" / "chunk-000" / f"episode_{k:06d}.parquet")
        episodes.append({"episode_index": k, "tasks": [task], "length": n})
        stats.append({"episode_index": k, "stats": {
            name: {"min": np.atleast_1d(v.min(axis=0)).tolist(), "max": np.atleast_1d(v.max(axis=0)).tolist(),
                   "mean": np.atleast_1d(v.mean(axis=0)).tolist(), "std": np.atleast_1d(v.std(axis=0)).tolist(), "count": [n]}
            for name, v in columns.items()}})  # fmt: skip
    info = {
        "codebase_version": "v2.1",
        "robot_type": "ur10e",
        "total_episodes": len(data),
        "total_frames": len(data.observations),
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": 1,
        "chunks_size": max(1000, len(data)),
        "fps": fps if fps != int(fps) else int(fps),
        "splits": {"train": f"0:{len(data)}"},
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "video_path": None,
        "features": features,
    }
    (root / "meta" / "info.json").write_text(json.dumps(info, indent=2))
    for name, lines in (
        ("episodes", episodes),
        ("episodes_stats", stats),
        ("tasks", [{"task_index": 0, "task": task}]),
    ):
        (root / "meta" / f"{name}.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
