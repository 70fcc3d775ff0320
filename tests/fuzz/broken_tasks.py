#!/usr/bin/env python3
"""Shipped tasks with one thing wrong, each read by `feeler task show`; resumable.

    tests/fuzz/broken_tasks.py --feeler build/feeler [--runs 600] [--seed 1] [--state state.json]

In a copy of models/, one attribute or one element of a task file, or of a file that it includes, is removed, repeated,
renamed or given another value. Law: the task is read (exit code 0), or the command ends with exit code 2, an empty standard
output and exactly one line on standard error, printable, `feeler: error: WHERE: WHAT (HOW TO MEND)`. Without --runs all
changes are tried, in an order drawn from the seed. Prints a JSON object; exit code 1 if the law was broken. Needs Python
3.9, nothing else.
"""
import argparse
import copy
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TASKS = ["plug", "round-peg", "pipe-into-elbow", "plug-flush"]
TEXTS = ["", "x", "é", "a" * 3000, "../../../../dev/zero", "/no/such"]
NUMBERS = ["nan", "inf", "-1", "0", "1e308", "1e-308", "1,5", "0x10", "99999999999"]
LINE = re.compile(r"^feeler: error: [^:].*: .+ \(.+\)$")


def files_of(task):
    """The task's file and what it includes, relative to models/."""
    found = []

    def visit(path):
        path = os.path.normpath(path)
        if path in found:
            return
        found.append(path)
        folder = os.path.dirname(path)
        for include in xml.parse(os.path.join(ROOT, "models", path)).iter("include"):
            visit(os.path.join(folder, include.get("file")))

    visit("tasks/%s.xml" % task)
    return found


def values_of(value):
    words = value.split()
    try:
        [float(word) for word in words]
    except ValueError:
        return TEXTS + ["0", "nan"]
    values = []
    for number in NUMBERS:
        for at in sorted({0, len(words) - 1}) if words else []:
            values.append(" ".join(words[:at] + [number] + words[at + 1:]))
    return values + ["", "x", value + " 1", " ".join(words[:-1])]


def changes(task):
    """All changes as (task, file, element number, what, attribute, value)."""
    all_of = []
    for path in files_of(task):
        for number, element in enumerate(xml.parse(os.path.join(ROOT, "models", path)).iter()):
            for what in ("remove", "repeat", "rename", "empty") if number > 0 else ("rename",):
                all_of.append((task, path, number, what, "", ""))
            all_of.append((task, path, number, "set", "unheard_of", "1"))
            for name, value in element.attrib.items():
                all_of.append((task, path, number, "drop", name, ""))
                all_of += [(task, path, number, "set", name, v) for v in values_of(value)]
    return all_of


def apply(change, models):
    _, path, number, what, attribute, value = change
    tree = xml.parse(os.path.join(ROOT, "models", path))
    elements = list(tree.iter())
    element = elements[number]
    parent = next((e for e in elements if element in list(e)), None)
    if what == "remove":
        parent.remove(element)
    elif what == "repeat":
        parent.append(copy.deepcopy(element))
    elif what == "rename":
        element.tag = "unheard_of"
    elif what == "empty":
        element.attrib.clear()
    elif what == "drop":
        del element.attrib[attribute]
    else:
        element.set(attribute, value)
    tree.write(os.path.join(models, path))


def fault_of(done):
    if done is None:
        return "no end"
    error = done.stderr.decode("utf-8", "replace")
    if done.returncode == 0:
        return None
    if done.returncode != 2:
        return "exit code %d" % done.returncode
    if done.stdout:
        return "a refusal with results"
    lines = error.rstrip("\n").split("\n")
    if len(lines) != 1:
        return "%d lines" % len(lines)
    if any(ord(c) < 32 or c == "\ufffd" for c in lines[0]) or len(lines[0]) > 2000:
        return "a line that is not printable or too long"
    return None if LINE.match(lines[0]) else "not WHERE: WHAT (HOW TO MEND)"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--feeler", default=os.path.join(ROOT, "build/feeler"))
    parser.add_argument("--runs", type=int, default=0, help="0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", default="")
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--verbose", action="store_true", help="print each message")
    args = parser.parse_args()
    feeler = os.path.abspath(args.feeler)
    cases = [change for task in args.tasks.split(",") for change in changes(task)]
    random.Random(args.seed).shuffle(cases)
    cases = cases[:args.runs] if args.runs else cases
    state = {"next": 0, "codes": {}, "faults": []}
    if args.state and os.path.exists(args.state):
        with open(args.state) as file:
            state = json.load(file)
    folder = tempfile.mkdtemp(prefix="feeler-broken-")
    models = os.path.join(folder, "models")
    try:
        shutil.copytree(os.path.join(ROOT, "models"), models)
        for k in range(state["next"], len(cases)):
            change = cases[k]
            apply(change, models)
            try:
                done = subprocess.run([feeler, "task", "show", os.path.join(models, "tasks", change[0] + ".xml")],
                                      capture_output=True, timeout=120, stdin=subprocess.DEVNULL)
            except subprocess.TimeoutExpired:
                done = None
            shutil.copyfile(os.path.join(ROOT, "models", change[1]), os.path.join(models, change[1]))
            fault = fault_of(done)
            code = "none" if done is None else str(done.returncode)
            state["codes"][code] = state["codes"].get(code, 0) + 1
            tail = "" if done is None else done.stderr.decode("utf-8", "replace")[-400:].replace(folder, "")
            if args.verbose:
                print(code, [c[:60] if isinstance(c, str) else c for c in change], tail.strip(), flush=True)
            if fault:
                state["faults"].append({"fault": fault, "change": [str(c)[:80] for c in change], "tail": tail})
            state["next"] = k + 1
            if args.state and (k % 50 == 0 or fault or k + 1 == len(cases)):
                with open(args.state + ".part", "w") as file:
                    json.dump(state, file, indent=1)
                os.replace(args.state + ".part", args.state)
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(json.dumps({"runs": state["next"], "of": len(cases), "codes": state["codes"],
                          "faults": len(state["faults"]), "cpu_s_this_call": round(usage.ru_utime + usage.ru_stime, 1)}))
        for fault in state["faults"][:20]:
            print(json.dumps(fault), file=sys.stderr)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if state["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
