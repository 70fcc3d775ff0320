"""Laws of experiments and report: they are those of the command line; stopped ones say so and go on; errors are the
package's own.
"""

from __future__ import annotations

import json

import pytest

import feeler

QUICK = "bounds"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    return folder, feeler.experiment(QUICK, folder, quick=True)


def test_every_experiment_says_what_it_is():
    known = feeler.experiments()
    assert QUICK in known and "table1-plug" in known and all(known.values())


def test_an_experiment_gives_its_file(results):
    folder, answer = results
    assert answer.complete and answer.text.strip()
    assert answer.data == json.loads((folder / f"{QUICK}.json").read_text())
    manifest = json.loads((folder / "manifest.json").read_text())
    assert feeler.__version__ in json.dumps(manifest) and "feeler.experiment" in json.dumps(manifest)


def test_a_report_is_one_page(results, tmp_path):
    folder, _ = results
    answer = feeler.report(folder, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert answer.experiments == 1 and answer.faults == [] and answer.bytes == len(page.encode())
    assert page.lstrip().lower().startswith("<!doctype html") and QUICK in page


def test_progress_may_stop_or_raise(tmp_path):
    stopped = feeler.experiment("bounds", tmp_path / "stopped", quick=True, progress=lambda done, total: False)
    assert not stopped.complete and stopped.data is None
    with pytest.raises(ZeroDivisionError):
        feeler.experiment("bounds", tmp_path / "raised", quick=True, progress=lambda done, total: 1 // 0)


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda path: feeler.experiment("table99", path), "table99"),
        (lambda path: feeler.experiment("bounds", path, task="no-such-task"), "no-such-task"),
        (lambda path: feeler.experiment("bounds", path, quick=True, jobs=0), "jobs"),
        (lambda path: feeler.report(path / "nothing", path / "x.html"), "nothing"),
        (lambda path: feeler.report(path, path / "x.html", replay_megabytes=float("nan")), "replay_megabytes"),
    ],
)
def test_bad_requests_are_one_sentence(call, what, tmp_path):
    with pytest.raises(feeler.InputError, match=what) as caught:
        call(tmp_path)
    assert "\n" not in str(caught.value)
