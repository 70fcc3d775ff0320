"""What the pages show works, the reference is the docstrings', the notebooks run, the examples run."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "python/notebooks").glob("*.ipynb"))


def test_code_of_the_planner_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/python-planner.md").read_text(encoding="utf-8")
    pieces = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(pieces) >= 7
    names: dict = {}
    for piece in pieces:
        exec(compile(piece, "docs/python-planner.md", "exec"), names)


def test_the_reference_is_that_of_the_docstrings():
    written = (ROOT / "docs/python-reference.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(ROOT / "python/tools/reference.py"))["reference"]()
    assert written == made, "run python/tools/reference.py > docs/python-reference.md"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_run_and_hold_no_outputs(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    assert all(
        not cell.get("outputs") and cell.get("execution_count") is None
        for cell in notebook.cells
        if cell.cell_type == "code"
    )
    nbclient.NotebookClient(
        notebook, timeout=600, startup_timeout=600, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()


@pytest.mark.parametrize(
    ("name", "arguments"), [("random_agent.py", []), ("own_robot.py", ["4"]), ("behaviour_cloning.py", ["--quick"])]
)
def test_examples_run(name, arguments, tmp_path):
    command = [sys.executable, str(ROOT / "python/examples" / name), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
