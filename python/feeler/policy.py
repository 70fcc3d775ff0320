"""Policies of one's own, in Python."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _feeler
from .planner import Problem


@dataclass(frozen=True)
class Belief:
    """What is known when a decision is due.

    Attributes:
        robot: (3,) cell of the tool in the lattice of the problem.
        hypotheses: (n, 4): offset x, y, z in cells and orientation of what is still possible, in the order of the problem.
        weights: (n,): those of the start belief, not renormalised.
    """

    robot: NDArray[np.int32]
    hypotheses: NDArray[np.int32]
    weights: NDArray[np.float64]


@dataclass(frozen=True)
class Move:
    """A guarded move along an axis (``"+x"`` to ``"-z"``) of at most so many cells."""

    direction: str
    cells: int
    kind: str = "move"


@dataclass(frozen=True)
class Insert:
    """The target is localized: insert; with ``confirm`` after touching along axes that no contact has pinned."""

    confirm: bool = True
    kind: str = "insert"


@dataclass(frozen=True)
class GiveUp:
    """The policy has no further move; the reason stands in the record."""

    reason: str
    kind: str = "give_up"


@dataclass(frozen=True)
class Spiral:
    """Insert without having localized: press on the face around the opening and slide outwards along a spiral."""

    radius_m: float = 0.0045
    pitch_m: float = 0.0015
    speed_m_s: float = 0.02
    press_n: float = 10.0
    kind: str = "spiral"


Decision = Move | Insert | GiveUp | Spiral


class Policy(ABC):
    """Decides the next action from what has been felt so far; runs in :func:`feeler.run` beside the built-in ones.

    Protocol: :meth:`begin`, then :meth:`next` and :meth:`observe` in turn until ``next`` returns something else than a
    move. ``next`` is repeatable: without an ``observe`` in between it returns the same decision. One object serves many
    episodes, one after the other; with ``jobs`` above 1, each episode works on a deep copy. What a method raises comes
    out of :func:`feeler.run`.
    """

    name: str = "python"
    """In the records."""

    def begin(self, problem: Problem) -> None:  # noqa: B027
        """Starts an episode; erases the past."""

    @abstractmethod
    def next(self, belief: Belief) -> Decision:
        """What to do in this belief: its hypotheses are consistent with every outcome since ``begin``."""

    def observe(self, cells: int, contact: bool) -> bool:
        """Tells the outcome of the move last returned. False: the policy holds no plan for it."""
        return True

    # What the library calls.
    _belief = staticmethod(Belief)

    def _for_episode(self, seed: int, episode: int) -> Any:
        import copy

        return _Adapter(copy.deepcopy(self))


class _Adapter:
    """A policy as the library sees it."""

    _belief = staticmethod(Belief)

    def __init__(self, policy: Policy) -> None:
        self.name = str(policy.name)
        self._policy = policy
        self.next = policy.next
        self.observe = policy.observe

    def begin(self, problem: _feeler.Problem) -> None:
        self._policy.begin(Problem(problem))
