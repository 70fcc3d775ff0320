"""The paper's tables and figures, measured; and the report of results."""

from __future__ import annotations

import json
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from .errors import as_path, input_error, one_sentence
from .planner import Progress
from .results import Result, fields


@lru_cache(maxsize=1)
def _module() -> Any:
    """Loaded when first used: it brings the libraries that read pictures. Wheels that are self-contained lack it."""
    try:
        from . import _evaluation
    except ImportError as error:
        raise input_error(
            "experiments",
            f"cannot be loaded here: {error}",
            "install the packages of packages.txt, or use feeler experiment",
        ) from error
    data = Path(__file__).parent / "data"
    if data.is_dir():
        _evaluation.set_data_folder(str(data))
    return _evaluation


def experiments() -> dict[str, str]:
    """Names of the experiments, with a line about each."""
    return _module().experiments()


@one_sentence
def experiment(
    name: str,
    out: str | os.PathLike[str],
    *,
    quick: bool = False,
    jobs: int = 1,
    task: str | None = None,
    seed: int = 1,
    solver_seeds: int = 0,
    progress: Progress | None = None,
) -> Result:
    """Runs an experiment, or goes on with one that was interrupted in the same folder; as ``feeler experiment``.

    Returns:
        Result: ``complete``, ``text`` (the table for people), and the content of NAME.json as ``data`` (None where it was
        stopped).
    """
    folder = as_path(out, "out")
    command = f"feeler.experiment({name!r}, {folder!r}, quick={quick}, seed={seed})"
    answer = fields(
        _module().run_experiment(name, folder, quick, jobs, task or "", seed, solver_seeds, command, progress)
    )
    answer.data = None
    if answer.complete:
        answer.data = fields(json.loads((Path(folder) / f"{name}.json").read_text(encoding="utf-8")))
    return answer


@one_sentence
def report(folder: str | os.PathLike[str], out: str | os.PathLike[str], replay_megabytes: float = 12.0) -> Result:
    """Writes one self-contained page of a folder of results: ``experiments``, ``episodes``, ``faults``, ``bytes``, ``path``."""
    return fields(_module().report(as_path(folder, "folder"), as_path(out, "out"), replay_megabytes))
