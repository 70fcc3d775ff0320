"""What the tests share: a database small enough to be made for each run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import feeler

os.environ.setdefault("PYGLET_HEADLESS", "1")


@pytest.fixture(scope="session")
def plug() -> feeler.Task:
    return feeler.load_task("plug")


@pytest.fixture(scope="session")
def database(tmp_path_factory: pytest.TempPathFactory, plug: feeler.Task) -> Path:
    path = tmp_path_factory.mktemp("db") / "plug.db"
    feeler.preprocess(plug, path, "2..3x2..3x2..3")
    return path
