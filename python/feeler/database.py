"""Databases of policies."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

from . import _feeler
from .errors import as_path, as_paths, input_error, one_sentence
from .planner import Cancellation, Extents, PolicyGraph, Progress, Task, as_task
from .results import Result, fields


@one_sentence
class Database:
    """The policies of a problem family for one task, in one SQLite file, read only.

    ``len(database)`` problems; iterating gives them without their policies, in lexicographic order of extents.

    Raises:
        InputError: for a file that is missing, damaged, or of another task.
    """

    def __init__(self, path: str | os.PathLike[str], task: Task | str | None = None) -> None:
        self._core = _feeler.Database.open(as_path(path, "path"))
        identity = self._core.identity
        self._task = task
        self.identity = Result(identity)

    @property
    def path(self) -> str:
        """Of the file."""
        return self._core.path

    @property
    def task(self) -> Task:
        """The task that it was made for, under the settings it was made with."""
        if not isinstance(self._task, Task):
            cost = "time" if '"time"' in self.identity.settings else None
            self._task = as_task(
                self._task or self.identity.task, opening=self.identity.opening, goal=self.identity.goal, cost=cost
            )
        return self._task

    def info(self) -> Result:
        """Sums over the database: the keys of ``feeler db info --json``."""
        return fields(self._core.info())

    def __len__(self) -> int:
        return len(self._core)

    def __iter__(self) -> Iterator[Result]:
        return iter([Result(row) for row in self._core.list()])

    def __contains__(self, extents: Any) -> bool:
        return self._core.contains(extents)

    def get(self, extents: Extents) -> Result | None:
        """The problem with these extents, with its ``policy`` (None where none was found); None if it is not there."""
        answer = self._core.get(extents, self.task._core)
        if answer is None:
            return None
        row, policy = answer
        unit = self.task.cost_unit
        return Result(row, policy=None if policy is None else PolicyGraph(policy, unit, self.task.name))

    def digest(self) -> str:
        """32 hexadecimal digits over the content: equal for equal databases."""
        return self._core.digest()

    def verify(
        self, jobs: int = 1, cancellation: Cancellation | None = None, progress: Progress | None = None
    ) -> Result:
        """Checks the file and replays every policy under every hypothesis: ``problems``, ``policies``, ``hypotheses``,
        ``largest_cost_error``, ``faults``, ``first_fault``."""
        return fields(self._core.verify(self.task._core, jobs, cancellation, progress))


@one_sentence
def preprocess(
    task: Task | str,
    out: str | os.PathLike[str],
    family: str | Sequence[Extents] | None = None,
    *,
    order: str = "uncertainty",
    experience: str = "rollout",
    jobs: int = 1,
    cancellation: Cancellation | None = None,
    progress: Progress | None = None,
    opening: str | None = None,
    goal: str | None = None,
    cost: str | None = None,
    **options: Any,
) -> Result:
    """Solves every problem of a family that the file does not hold yet; resumes.

    Args:
        family: ranges per axis ("2..5x2..5x2..5"), a list of extents, or None: the ranges of the task file.
        progress: called with problems done and problems in all; returning False stops cleanly, and what is done is kept.
        options: of the solver, as :func:`solve` takes them.

    Returns:
        Result: ``problems``, ``skipped``, ``complete``, ``failed``, ``cancelled``, ``wall_s``, ``cpu_s`` of this run, and
        ``info`` of the whole database.
    """
    loaded = as_task(task, opening=opening, goal=goal, cost=cost)
    if family is not None and not isinstance(family, str | Sequence):
        raise input_error("family", f"is of type {type(family).__name__}", 'give "2..5x2..5x2..5" or a list of extents')
    summary, info = _feeler.preprocess(
        loaded._core, family, options, order, experience, jobs, as_path(out, "out"), cancellation, progress
    )
    return Result(fields(summary), info=fields(info))


@one_sentence
def merge(paths: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str]) -> int:
    """Puts databases of one task and one setting together; where two hold the same problem, the better answer stays.

    Returns:
        int: how many problems were written.
    """
    return _feeler.merge_databases(as_paths(paths, "paths"), as_path(out, "out"))
