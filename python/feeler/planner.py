"""Tasks, contact maps, problems and their policies."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _feeler
from ._feeler import Cancellation
from .errors import as_path, input_error, one_sentence
from .results import Result, fields

Extents = str | Sequence[int]
Progress = Callable[[int, int], bool | None]


def list_tasks() -> list[str]:
    """Names of the shipped tasks, sorted."""
    return _feeler.list_tasks()


@one_sentence
class ContactMap:
    """How far the tool can travel, in each direction, from each displacement relative to the target before contact.

    Displacements are cells, r - h; arrays are (x, y, z) and begin at ``origin``. Travel is in cells; what meets nothing
    travels 1e9.
    """

    def __init__(self, core: _feeler.ContactMap) -> None:
        self._core = core

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of displacements along x, y, z."""
        x, y, z = (int(n) for n in self._core.shape)
        return x, y, z

    @property
    def origin(self) -> NDArray[np.int32]:
        """The displacement of element (0, 0, 0), cells."""
        return self._core.origin

    @property
    def phase(self) -> NDArray[np.float64]:
        """Where lattice points lie between cells: displacement in metres = (cells + phase) * cell size."""
        return self._core.phase

    @property
    def margin_cells(self) -> float:
        """Smallest distance from a wall to a lattice plane; 0.5 at best."""
        return self._core.margin_cells

    @property
    def orientations(self) -> int:
        """Layers: one where the orientation is certain."""
        return self._core.orientations

    def travel(self, direction: str, orientation: int = 0) -> NDArray[np.float32]:
        """Travel in a direction (``"+x"`` ...), float32 of ``shape``."""
        return self._core.travel(direction, orientation)

    def blocked(self, orientation: int = 0) -> NDArray[np.bool_]:
        """Whether tool and target overlap, bool of ``shape``."""
        return self._core.blocked(orientation)


@one_sentence
class Problem:
    """A start belief and everything needed to plan from it."""

    def __init__(self, core: _feeler.Problem, unit: str = "weighted", task: str = "") -> None:
        self._core, self._unit, self._task = core, unit, task

    @property
    def name(self) -> str:
        """Of the task with its extents, or of the lattice file."""
        return self._core.name

    @property
    def start(self) -> NDArray[np.int32]:
        """Cell of the tool at the start."""
        return self._core.start

    @property
    def hypotheses(self) -> NDArray[np.int32]:
        """(n, 4): offset x, y, z in cells, and orientation layer; indices in results refer to these rows."""
        return self._core.hypotheses

    @property
    def weights(self) -> NDArray[np.float64]:
        """(n,): the prior, of any positive scale."""
        return self._core.weights

    @property
    def goal(self) -> str:
        """``"singleton"`` or ``"insertable"``."""
        return self._core.goal

    @property
    def contact_map(self) -> ContactMap:
        """What decides about contact."""
        return ContactMap(self._core.contact_map)

    def outcome(self, robot: ArrayLike, direction: str, cells: int, hypothesis: int) -> tuple[int, bool]:
        """What a guarded move from a cell returns if a hypothesis is true: cells travelled, contact."""
        return self._core.outcome(np.asarray(robot, dtype=np.int32), direction, cells, hypothesis)

    def split(
        self, robot: ArrayLike, direction: str, cells: int, left: Iterable[int] | None = None
    ) -> dict[tuple[int, bool], NDArray[np.int64]]:
        """How a guarded move splits a belief: outcome -> indices of the hypotheses that give it, of those ``left``."""
        answers: dict[tuple[int, bool], list[int]] = {}
        for hypothesis in range(len(self.hypotheses)) if left is None else left:
            answers.setdefault(self.outcome(robot, direction, cells, int(hypothesis)), []).append(int(hypothesis))
        return {outcome: np.array(which, dtype=np.int64) for outcome, which in sorted(answers.items())}


@one_sentence
class PolicyGraph:
    """What to do after each history of moves and outcomes: an acyclic graph from a start belief to its leaves."""

    def __init__(self, core: _feeler.PolicyGraph, unit: str = "weighted", task: str = "") -> None:
        self._core, self._unit, self._task = core, unit, task
        self._nodes: list[Result] | None = None

    def __len__(self) -> int:
        return len(self._core)

    @property
    def expected_cost(self) -> float:
        """Exact, over every hypothesis of the start belief."""
        return self._core.expected_cost

    @property
    def lower_bound(self) -> float:
        """Proven."""
        return self._core.lower_bound

    @property
    def problem(self) -> Problem:
        """What it is a policy for."""
        return Problem(self._core.problem, self._unit, self._task)

    def nodes(self) -> list[Result]:
        """The policy as a tree in the coordinates of its problem, node 0 the root, parents before children. Fields: ``move``
        (direction, cells; None at a leaf), ``outcomes`` [(cells, contact, next, probability)], ``hypotheses`` (indices
        left), ``robot`` (cell), ``probability`` of reaching it, ``expected_cost`` to go."""
        if self._nodes is None:
            self._nodes = [Result(node) for node in self._core.expand()]
        return self._nodes

    def walk(self, hypothesis: int) -> list[Result]:
        """The nodes that are passed if this hypothesis is true, root to leaf, each with the ``outcome`` it met (None at the
        leaf): a belief as it shrinks."""
        nodes, problem = self.nodes(), self.problem
        if not isinstance(hypothesis, int | np.integer) or not 0 <= hypothesis < len(problem.hypotheses):
            raise input_error("hypothesis", f"{hypothesis!r} of {len(problem.hypotheses)}", "count from 0")
        path, at = [], 0
        while True:
            node = Result(nodes[at], outcome=None)
            path.append(node)
            if node.move is None:
                return path
            node.outcome = problem.outcome(node.robot, node.move[0], node.move[1], hypothesis)
            at = next(b[2] for b in node.outcomes if (b[0], b[1]) == node.outcome)

    def evaluate(self) -> Result:
        """Replays the policy under every hypothesis: ``valid``, ``fault``, ``expected_cost``, ``worst_cost``,
        ``expected_moves``, ``expected_contacts``, ``expected_cells``, ``cost`` per hypothesis."""
        return fields(self._core.evaluate())

    def draw(self, format: str = "dot", max_depth: int = 2**31 - 1, min_probability: float = 0.0) -> str:
        """Graphviz text (``"dot"``) or a page (``"html"``)."""
        return self._core.draw(format, self._task or self.problem.name, max_depth, min_probability)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the policy file (docs/file-formats.md)."""
        self._core.save(as_path(path, "path"), self._task or self.problem.name)

    def to_dict(self) -> dict[str, Any]:
        """The content of the policy file."""
        return json.loads(self._core.json(self._task or self.problem.name))

    def to_networkx(self) -> Any:
        """A ``networkx.DiGraph``: nodes with the fields of :meth:`nodes`, edges with ``cells``, ``contact``, ``probability``."""
        import networkx

        graph = networkx.DiGraph()
        for number, node in enumerate(self.nodes()):
            graph.add_node(number, **node)
            for cells, contact, successor, probability in node.outcomes:
                graph.add_edge(number, successor, cells=cells, contact=contact, probability=probability)
        return graph


@one_sentence
class Task:
    """What is inserted into what: the numbers of a task file, and what planning needs of its geometry.

    Args:
        name: of a shipped task, or the path of a task file.
        opening: ``"closed"`` or ``"open"`` while localizing.
        goal: ``"singleton"`` or ``"insertable"``; None: the task's.
        cost: ``"distance"`` (the task's weights) or ``"time"`` (seconds).

    Raises:
        InputError: naming file, element and field.
    """

    def __init__(
        self,
        name: str | os.PathLike[str] = "plug",
        opening: str = "closed",
        goal: str | None = None,
        cost: str = "distance",
    ) -> None:
        self._core = _feeler.PlanningTask(as_path(name, "task"), opening, goal or "", cost)
        self.opening, self.goal, self.cost = opening, goal, cost

    name = property(lambda self: self._core.name, doc="As the file says.")
    file = property(lambda self: self._core.file, doc="Path of the task file.")
    argument = property(lambda self: self._core.argument, doc="What the task was asked for by.")
    cell_m = property(lambda self: self._core.cell_m, doc="Lattice spacing, m.")
    insertion = property(
        lambda self: self._core.insertion, doc='Direction of the insertion in axes of the target: "-z".'
    )
    insertion_depth_m = property(lambda self: self._core.insertion_depth_m, doc="From the mouth to fully inserted, m.")
    start_offset_m = property(lambda self: self._core.start_offset_m, doc="(3,): of the tool from the estimate, m.")
    move_lengths = property(lambda self: self._core.move_lengths, doc="Lengths of guarded moves, cells.")
    world_T_target = property(lambda self: self._core.world_T_target, doc="(4, 4): nominal pose of the target.")
    fingerprint = property(lambda self: self._core.fingerprint, doc="What a database must have been made for.")

    @property
    def axes(self) -> list[Result]:
        """The uncertain axes: ``kind``, ``resolution`` with its ``unit``, ``min_cells``, ``max_cells``."""
        return [Result(axis) for axis in self._core.axes]

    @property
    def tolerance(self) -> Result:
        """With which error an insertion still succeeds: ``lateral_m``, ``vertical_m``, ``angle_rad``.

        Where axes of the target frame differ these are the least; all stand in ``lateral_per_axis_m``
        (of which the two across the insertion count) and ``angle_per_axis_rad``.
        """
        return Result(self._core.tolerance)

    @property
    def cost_unit(self) -> str:
        """Unit of the costs: "s", "cells" or "weighted"."""
        return self._core.cost_unit()

    def contact_map(self, jobs: int = 1, progress: Progress | None = None) -> ContactMap:
        """The contact map, from the cache or from the models (seconds for a part, minutes where angles are uncertain)."""
        self._core.load(jobs, progress)
        return ContactMap(self._core.contact_map)

    def problem(self, extents: Extents) -> Problem:
        """The cuboid of hypotheses with so many along each axis of the task, e.g. (7, 7, 5) or "7x7x5"."""
        return Problem(self._core.problem(extents), self.cost_unit, self.name)

    def __repr__(self) -> str:
        return f"Task({self.argument!r}, axes={[axis.kind for axis in self.axes]})"


@lru_cache(maxsize=32)
def _cached(name: str, opening: str, goal: str | None, cost: str) -> Task:
    return Task(name, opening, goal, cost)


def load_task(
    name: str | os.PathLike[str] = "plug", opening: str = "closed", goal: str | None = None, cost: str = "distance"
) -> Task:
    """A task by name or path; see :class:`Task`. The file is read anew each time."""
    return Task(name, opening, goal, cost)


def as_task(task: Task | str | os.PathLike[str], **how: Any) -> Task:
    """A task that may be given by name; shipped tasks are loaded once."""
    if isinstance(task, Task):
        if any(value is not None for value in how.values()):
            raise input_error("task", "is loaded already", "give opening, goal and cost to load_task")
        return task
    how = {key: value for key, value in how.items() if value is not None}
    if isinstance(task, str) and task in _feeler.list_tasks():
        return _cached(task, how.get("opening", "closed"), how.get("goal"), how.get("cost", "distance"))
    if not isinstance(task, str | os.PathLike):
        raise input_error("task", f"is of type {type(task).__name__}", "give a name, a path or a Task")
    return Task(task, **how)


@one_sentence
def contact_map(
    task: Task | str, opening: str | None = None, jobs: int = 1, progress: Progress | None = None
) -> ContactMap:
    """The contact map of a task."""
    return as_task(task, opening=opening).contact_map(jobs, progress)


@one_sentence
def solve(
    task: Task | Problem | str | os.PathLike[str],
    extents: Extents | None = None,
    *,
    opening: str | None = None,
    goal: str | None = None,
    cost: str | None = None,
    on_bounds: Callable[[Result], bool | None] | None = None,
    cancellation: Cancellation | None = None,
    jobs: int = 1,
    **options: Any,
) -> Result:
    """Solves one problem; the result has the keys of ``feeler solve --json`` as fields, and ``policy``.

    Args:
        task: a task (with ``extents``) or a :class:`Problem`.
        extents: hypotheses per axis of the task.
        on_bounds: called with each row of the bounds table (``wall_s``, ``trials``, ``expansions``, ``lower_bound``,
            ``upper_bound``, ``ratio``) as the bounds close; returning False stops, and what is found by then is the answer.
            What it raises comes out here.
        cancellation: :meth:`Cancellation.cancel` of it, from any thread, stops likewise.
        options: ``solver`` (``"certified"``, ``"rtdp-bel"``, ``"e-rtdp-bel"``), ``epsilon``, ``gap``, ``time_limit_s``,
            ``cpu_limit_s``, ``expansion_limit``, ``memory_limit_bytes``, ``seed``, ``heuristic``, ``setting`` (``"fast"``,
            ``"paper"``).

    Returns:
        Result: ``status`` (``"converged"``, ``"gap"``, ``"time_limit"``, ``"expansion_limit"``, ``"cancelled"``,
        ``"unlocalizable"``, ``"memory_limit"``), ``expected_cost``, ``lower_bound``, ``ratio`` (infinity without a policy),
        ``expansions``, ``cpu_s``, ``wall_s``, ``policy_nodes``, ``policy`` (None without one), ...
    """
    if isinstance(task, Problem):
        if extents is not None:
            raise input_error("extents", "go with a task, not with a problem", "leave them out")
        problem = task
    else:
        if extents is None:
            raise input_error("extents", "missing", "give the extents, e.g. extents=(7, 7, 5)")
        loaded = as_task(task, opening=opening, goal=goal, cost=cost)
        loaded.contact_map(jobs)
        problem = loaded.problem(extents)
    callback = None if on_bounds is None else lambda row: on_bounds(Result(row))
    answer, policy = _feeler.solve(problem._core, options, cancellation, callback, jobs, problem._unit)
    result = fields(answer)
    result.policy = None if policy is None else PolicyGraph(policy, problem._unit, problem._task)
    return result


def require_policy_for(policy: PolicyGraph, task: Task, extents: Extents) -> None:
    """Raises InputError unless the policy was made for these hypotheses."""
    given, own = task.problem(extents)._core, policy._core.problem
    if not (np.array_equal(given.hypotheses, own.hypotheses) and np.array_equal(given.start, own.start)):
        raise input_error(
            "extents",
            f"make another problem ({given.name}) than the policy is for ({own.name})",
            "give those of the policy",
        )


def evaluate(policy: PolicyGraph) -> Result:
    """Replays a policy under every hypothesis (:meth:`PolicyGraph.evaluate`)."""
    return policy.evaluate()


def lattice_problem(
    tool: NDArray[np.bool_],
    target: NDArray[np.bool_],
    *,
    hypotheses: ArrayLike,
    start: Sequence[int],
    size: Sequence[int],
    tool_origin: Sequence[int] = (0, 0, 0),
    target_origin: Sequence[int] = (0, 0, 0),
    weights: ArrayLike | None = None,
    move_lengths: Sequence[int] = (1, 2, 4, 8, 16),
    per_cell: float = 1.0,
    per_contact: float = 0.0,
    per_action: float = 0.0,
    goal: str = "singleton",
    insertable_spread: Sequence[int] | None = None,
    name: str = "voxels",
) -> Problem:
    """A problem without a robot, from voxel arrays.

    Args:
        tool: bool (x, y, z): cells of the tool, relative to the robot's cell; ``tool_origin`` is the cell of element (0, 0, 0).
        target: the same of the target, relative to a hypothesis.
        hypotheses: (n, 3) whole numbers: offsets of the target, cells.
        start: cell of the robot.
        size: the robot stays in cells 0 to size - 1.
        weights: (n,): the prior, of any positive scale; default: equal.
    """

    def cells(voxels: Any, origin: Sequence[int], where: str) -> list[list[int]]:
        array = np.asarray(voxels)
        if array.ndim != 3 or array.dtype != np.bool_:
            raise input_error(where, f"is {array.dtype} of {array.ndim} dimensions", "give a bool array of three")
        return (np.argwhere(array) + np.asarray(origin, dtype=int)).tolist()

    offsets = np.asarray(hypotheses)
    if offsets.ndim != 2 or offsets.shape[1] != 3 or offsets.dtype.kind not in "iu":
        raise input_error("hypotheses", f"are {offsets.dtype} of shape {offsets.shape}", "give (n, 3) whole numbers")
    scale = np.ones(len(offsets)) if weights is None else np.asarray(weights, dtype=float)
    if scale.shape != (len(offsets),):
        raise input_error("weights", f"have shape {scale.shape}", f"give ({len(offsets)},)")
    data: dict[str, Any] = {
        "name": name,
        "size": [int(n) for n in size],
        "start": [int(n) for n in start],
        "tool": cells(tool, tool_origin, "tool"),
        "target": cells(target, target_origin, "target"),
        "hypotheses": [[*map(int, offset), float(weight)] for offset, weight in zip(offsets, scale, strict=True)],
        "move_lengths": [int(n) for n in move_lengths],
        "cost": {"per_cell": per_cell, "per_contact": per_contact, "per_action": per_action},
        "goal": goal,
    }
    if insertable_spread is not None:
        data["insertable_spread"] = [int(n) for n in insertable_spread]
    return Problem(_feeler.lattice_problem(json.dumps(data)))


def read_problem(path: str | os.PathLike[str]) -> Problem:
    """A lattice problem file (docs/file-formats.md)."""
    return Problem(_feeler.read_lattice_problem(as_path(path, "path")))
