#!/usr/bin/env python3
"""Mutation run: would the tests notice?

Flips one operator or constant of a source file at a time, builds the tests of its room and runs them. A mutant is
*killed* if the tests fail, crash or hang (those in the folder of the same name run first), *invalid* if it does not compile, *alive* if all tests pass: then nothing
asserts what the flipped token decides. The score is killed / (killed + alive).

    tests/mutation/mutate.py --build build --sample 40 --seed 1 planner/search planner/policy execution

Sources are changed in place and restored, also after Ctrl-C; a file with changes that are not committed is refused.
The same seed gives the same mutants. Results go to stdout, one JSON object a mutant, the score last.
"""

import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Tests that judge a folder: target, filter of GoogleTest.
JUDGES = {
    "planner": ("planner_tests", "*"),
    "execution": ("execution_tests", "*"),
    "policies": ("policies_tests", "*"),
}

# Token (as it stands between spaces) and what takes its place.
FLIPS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&", "+": "-", "-": "+",
    "*": "/", "+=": "-=", "-=": "+=", "&": "|", "|": "&",
}
OPERATOR = re.compile(r"(?<= )(<=|>=|==|!=|&&|\|\||\+=|-=|[<>+\-*&|])(?= )")
CONSTANT = re.compile(r"(?<![\w.\"])(\d+\.\d+(?:e-?\d+)?|\d+)(?![\w.\"])")
WORDS = re.compile(r"\b(std::min|std::max|true|false|kInfinity)\b")
WORD_FLIPS = {"std::min": "std::max", "std::max": "std::min", "true": "false", "false": "true", "kInfinity": "0.0"}


def code_lines(text):
    """Line numbers and lines that hold code of a function: no comments, includes, asserts, templates."""
    for number, line in enumerate(text.split("\n")):
        code = line.split("//")[0]
        stripped = code.strip()
        if not stripped or not line.startswith("  ") or stripped.startswith(("///", "#", "static_assert", "assert")):
            continue
        if "template" in code or "using " in code or re.search(r"\boperator\b", code):
            continue
        yield number, code


def mutants_of(path):
    """(file, line, column, from, to) of every mutant of a file."""
    text = path.read_text()
    for number, code in code_lines(text):
        for match in OPERATOR.finditer(code):
            yield path, number, match.start(), match.group(), FLIPS[match.group()]
        for match in CONSTANT.finditer(code):
            old = match.group()
            new = repr(float(old) * 2 + 1) if "." in old else str(int(old) + 1)
            yield path, number, match.start(), old, new
        for match in WORDS.finditer(code):
            yield path, number, match.start(), match.group(), WORD_FLIPS[match.group()]


def run(command, timeout):
    """Return code; None after a timeout."""
    try:
        return subprocess.run(command, cwd=ROOT, timeout=timeout, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, check=False).returncode
    except subprocess.TimeoutExpired:
        return None


SUITE = re.compile(r"^(?:TEST|TEST_F|TEST_P|TYPED_TEST)\((\w+),", re.M)


def near(path):
    """Filter of the suites that stand in the tests' folder of the same name: they notice first."""
    folder = ROOT / "tests" / path.relative_to(ROOT).parent
    suites = sorted({suite for file in folder.glob("*.cpp") for suite in SUITE.findall(file.read_text())})
    return ":".join(f"{suite}.*:*/{suite}.*:{suite}/*" for suite in suites)


def judge(mutant, build, timeout, test_filter):
    path, number, column, old, new = mutant
    original = path.read_text()
    lines = original.split("\n")
    line = lines[number]
    assert line[column:column + len(old)] == old
    lines[number] = line[:column] + new + line[column + len(old):]
    target, default_filter = JUDGES[path.relative_to(ROOT).parts[0]]
    try:
        path.write_text("\n".join(lines))
        if run(["ninja", "-C", str(build), target], 3600) != 0:
            return "invalid"
        for tests in filter(None, [test_filter] if test_filter else [near(path), default_filter]):
            if run([str(build / target), f"--gtest_filter={tests}", "--gtest_fail_fast"], timeout) != 0:
                return "killed"
        return "alive"
    finally:
        path.write_text(original)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", help="files or folders of sources, from the root of the tree")
    parser.add_argument("--build", default="build", help="a configured build folder")
    parser.add_argument("--sample", type=int, default=0, help="so many mutants, drawn; 0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=600.0, help="seconds for the tests of a mutant")
    parser.add_argument("--filter", default="", help="of GoogleTest, in place of all tests of the room")
    options = parser.parse_args()

    files = []
    for name in options.paths:
        path = (ROOT / name).resolve()
        if not path.exists():
            sys.exit(f"mutate: error: {name}: does not exist (name folders from the root of the tree)")
        files += [path] if path.is_file() else sorted(p for s in ("*.h", "*.cpp") for p in path.rglob(s))
    changed = subprocess.run(["git", "status", "--porcelain", "--"] + [str(f) for f in files], cwd=ROOT,
                             capture_output=True, text=True, check=True).stdout.strip()
    if changed:
        sys.exit(f"mutate: error: {changed.split()[-1]}: has changes (commit them: sources are rewritten in place)")
    mutants = [m for f in files for m in mutants_of(f)]
    random.Random(options.seed).shuffle(mutants)
    drawn = mutants[:options.sample] if options.sample else mutants
    build = (ROOT / options.build).resolve()
    counts = {"killed": 0, "alive": 0, "invalid": 0}
    for i, mutant in enumerate(drawn):
        begun = time.monotonic()
        verdict = judge(mutant, build, options.timeout, options.filter)
        counts[verdict] += 1
        path, number, _, old, new = mutant
        print(json.dumps({"file": str(path.relative_to(ROOT)), "line": number + 1, "from": old, "to": new,
                          "verdict": verdict, "seconds": round(time.monotonic() - begun, 1)}), flush=True)
        print(f"\r{i + 1} of {len(drawn)}: {counts}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    judged = counts["killed"] + counts["alive"]
    print(json.dumps({"mutants": len(mutants), "drawn": len(drawn), **counts,
                      "score": round(counts["killed"] / judged, 3) if judged else None}))


if __name__ == "__main__":
    main()
