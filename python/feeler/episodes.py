"""Seeded episodes in simulation."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from . import _feeler
from .database import Database
from .errors import as_path, input_error, one_sentence
from .planner import Cancellation, Extents, PolicyGraph, Progress, Task, as_task, require_policy_for
from .policy import Policy
from .results import Result, fields


class Episode(Result):
    """The record of one episode: the fields of a line of a records file (docs/file-formats.md)."""


class Run(Result):
    """What episodes came to: the keys of ``feeler run --json`` as fields, and ``records``, a list of :class:`Episode`."""

    def __iter__(self) -> Iterator[str]:
        return super().__iter__()

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``, one row an episode, columns of the scalar fields; nested ones as ``error.lateral_m``."""
        import pandas

        frame = pandas.json_normalize([dict(record) for record in self["records"]])
        return frame[[c for c in frame.columns if not frame[c].map(lambda v: isinstance(v, list | dict)).any()]]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the records, one JSON object a line."""
        path = as_path(path, "path")
        partial = f"{path}.part"
        with open(partial, "w", encoding="utf-8") as file:
            for record in self["records"]:
                file.write(json.dumps(record, separators=(",", ":")) + "\n")
        os.replace(partial, path)


def policy_names() -> list[str]:
    """Names of the built-in policies."""
    return _feeler.policy_names()


def fault_names() -> dict[str, str]:
    """What ``noise`` takes, with a line about each."""
    return _feeler.fault_names()


def given_policy(policy: Any, task: Task, extents: Extents | None) -> Any:
    """What the library is given for a policy of episodes. Raises InputError for none, and for a graph of another problem."""
    if not isinstance(policy, str | Policy | PolicyGraph):
        raise input_error(
            "policy", f"is of type {type(policy).__name__}", "give a name, a feeler.Policy or a PolicyGraph"
        )
    if not isinstance(policy, PolicyGraph):
        return policy
    if extents is None:
        raise input_error("extents", "missing", "give those that the policy is for")
    require_policy_for(policy, task, extents)
    return policy._core


@one_sentence
def run(
    task: Task | str | os.PathLike[str] = "plug",
    policy: str | Policy | PolicyGraph = "database",
    *,
    database: Database | str | os.PathLike[str] | None = None,
    episodes: int = 1,
    first: int = 0,
    seed: int = 1,
    extents: Extents | None = None,
    noise: str = "ideal",
    placement: str = "nominal",
    table: str | os.PathLike[str] | None = None,
    force_budget: float | None = None,
    wrist_stiffness: float = 0.0,
    ladder: bool | None = None,
    withhold_true_pose: bool = False,
    replay: bool = False,
    policy_options: dict[str, Any] | Sequence[str] = (),
    robot: Callable[[_feeler.SimulatedRobot], Any] | None = None,
    jobs: int = 1,
    cancellation: Cancellation | None = None,
    on_record: Callable[[dict[str, Any]], bool | None] | None = None,
    progress: Progress | None = None,
) -> Run:
    """Runs seeded episodes: transfer, localize by touch, insert, score. As ``feeler run``.

    Args:
        policy: a name (:func:`policy_names`), a policy in Python, or a graph (with its ``extents``).
        database: for policies that read one; its problems are those that are met, unless ``extents`` are given.
        first: number of the first episode.
        noise: names of :func:`fault_names`, with commas between.
        table: an uncertainty table: hypotheses come from a simulated depth camera.
        force_budget: no contact is to push harder, N; default: the task's, or more where the noise of the sensor asks for it.
        wrist_stiffness: of springs between gripper and tool, N/m (2000 or more); 0: held rigidly.
        ladder: fallbacks; default: as the policy has them.
        replay: keep what the episodes looked like in their records (for the report).
        robot: called with the simulated robot at the start of each episode; what it returns (a :class:`feeler.Robot`)
            stands between the executor and the simulation.
        on_record: called with each record, in order; returning False stops after it.
        progress: called with episodes done and in all; returning False stops.

    Returns:
        Run: ``episodes``, ``localized``, ``inserted``, ``sim_time_median_s``, ..., and ``records``.
    """
    loaded = as_task(task)
    if isinstance(database, str | os.PathLike):
        database = Database(database)
    given = given_policy(policy, loaded, extents)
    options = (
        [f"{k}={v}" for k, v in policy_options.items()] if isinstance(policy_options, dict) else list(policy_options)
    )
    summary, records = _feeler.run(
        loaded._core,
        given,
        None if database is None else database._core,
        options,
        episodes,
        first,
        seed,
        extents,
        noise,
        placement,
        "" if table is None else as_path(table, "table"),
        force_budget,
        wrist_stiffness,
        ladder,
        withhold_true_pose,
        replay,
        robot,
        jobs,
        cancellation,
        on_record,
        progress,
    )
    name = policy if isinstance(policy, str) else getattr(policy, "name", "graph")
    return Run(fields(summary), policy=name, records=[Episode(fields(record)) for record in records])


def read_records(path: str | os.PathLike[str]) -> Run:
    """A records file (``feeler run --out``) with its summary. Raises InputError naming file and line."""
    summary = fields(_feeler.summarize(as_path(path, "path")))
    with open(path, encoding="utf-8") as file:
        records = [Episode(fields(json.loads(line))) for line in file if line.strip()]
    return Run(summary, records=records)
