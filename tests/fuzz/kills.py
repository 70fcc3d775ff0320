#!/usr/bin/env python3
"""SIGKILL at random moments of commands that write; resumable.

    tests/fuzz/kills.py --feeler build/feeler --kills 200 --seed 1 --state state.json [--commands preprocess,run]

Laws, checked after every kill:
- preprocess: the database verifies, and holds no problem less than before the kill;
- run, assemble (records), report (page), calibrate (table): the file is the one of before or a new one that is whole;
  what a calibration had measured is still there;
- after the last kill of a folder the same command, left alone, ends well, its result is what an undisturbed run gives
  (measured times excepted), and no `*.part` stands about.
Prints a JSON object a command; exit code 1 if a law was broken. Needs Python 3.9, nothing else.
"""
import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def call(feeler, arguments):
    return subprocess.run([feeler] + arguments, capture_output=True, stdin=subprocess.DEVNULL)


def must(feeler, arguments):
    done = call(feeler, arguments)
    if done.returncode != 0:
        sys.exit("%s: %s" % (" ".join(arguments), done.stderr.decode("utf-8", "replace")[-300:]))


def read(path):
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        return None


def records_fault(data):
    """None if every line is a whole JSON object."""
    if not data.endswith(b"\n"):
        return "the last record is cut off"
    for line in data.splitlines():
        json.loads(line)
    return None


class Command:
    """What is killed: `arguments(folder)`, its output, and what may stand there afterwards."""

    def __init__(self, feeler, shared):
        self.feeler, self.shared = feeler, shared

    def prepare(self, folder):
        pass

    def before(self, folder):
        return read(self.out(folder))

    def fault(self, folder, before):
        after = read(self.out(folder))
        return None if after == before else self.whole(after)

    def whole(self, data):
        return "the file has gone" if data is None else None


class Preprocess(Command):
    name = "preprocess"

    def out(self, folder):
        return os.path.join(folder, "x.db")

    def arguments(self, folder):
        return ["preprocess", "--task", "plug", "--family", "2..9x2..9x2..9", "--out", self.out(folder)]

    def count(self, folder):
        if not os.path.exists(self.out(folder)) or os.path.getsize(self.out(folder)) == 0:
            return 0
        info = call(self.feeler, ["db", "info", self.out(folder), "--json"])
        return json.loads(info.stdout)["problems"] if info.returncode == 0 else -1

    def before(self, folder):
        return self.count(folder)

    def fault(self, folder, before):
        after = self.count(folder)
        if after < before:
            return "%d problems, %d before" % (after, before)
        if after > 0 and call(self.feeler, ["db", "verify", self.out(folder)]).returncode != 0:
            return "the database does not verify"
        return None


class Run(Command):
    name = "run"

    def out(self, folder):
        return os.path.join(folder, "e.jsonl")

    def arguments(self, folder):
        return ["run", "--task", "plug", "--policy", "open-loop", "--extents", "3x3x3", "--episodes", "4", "--out",
                self.out(folder)]

    def whole(self, data):
        return "the file has gone" if data is None else records_fault(data)


class Assemble(Command):
    name = "assemble"

    def out(self, folder):
        return os.path.join(folder, "a.jsonl")

    def arguments(self, folder):
        databases = [part for database in self.shared["databases"] for part in ("--db", database)]
        return ["assemble", "--assembly", "crane", "--no-ladder", "--out", self.out(folder)] + databases

    def whole(self, data):
        return "the file has gone" if data is None else records_fault(data)


class Report(Command):
    name = "report"

    def out(self, folder):
        return os.path.join(folder, "r.html")

    def arguments(self, folder):
        return ["report", self.shared["results"], "--out", self.out(folder)]

    def whole(self, data):
        return None if data is not None and data.rstrip().endswith(b"</html>") else "the page is cut off"


class Calibrate(Command):
    name = "calibrate"

    def out(self, folder):
        return os.path.join(folder, "t.json")

    def partial(self, folder):
        data = read(self.out(folder) + ".partial.jsonl") or b""
        return max(0, data.count(b"\n") - 1)

    def arguments(self, folder):
        return ["perceive", "calibrate", "--task", "plug", "--poses", "30", "--installations", "2", "--frames", "1",
                "--out", self.out(folder)]

    def before(self, folder):
        return read(self.out(folder)), self.partial(folder)

    def fault(self, folder, before):
        table, kept = before
        after = read(self.out(folder))
        if after == table:
            return "measured poses are lost" if self.partial(folder) < kept else None
        json.loads(after)
        return None


COMMANDS = [Preprocess, Run, Calibrate, Report, Assemble]


def kill_once(command, folder, longest_s, rng):
    """Starts, kills after a while, says how long it ran and what is wrong then."""
    before = command.before(folder)
    begin = time.time()
    child = subprocess.Popen([command.feeler] + command.arguments(folder), stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL)
    try:
        child.wait(timeout=rng.uniform(0.0, longest_s))
    except subprocess.TimeoutExpired:
        child.send_signal(signal.SIGKILL)
        child.wait()
    killed = child.returncode == -signal.SIGKILL
    try:
        return killed, time.time() - begin, command.fault(folder, before)
    except (ValueError, KeyError) as error:
        return killed, time.time() - begin, str(error)


def last_fault(command, folder):
    """The command left alone after all its kills."""
    done = call(command.feeler, command.arguments(folder))
    if done.returncode != 0:
        return "exit code %d at the end: %s" % (done.returncode, done.stderr.decode("utf-8", "replace")[-200:])
    parts = [name for name in os.listdir(folder) if name.endswith(".part")]
    return "leftovers: " + ", ".join(parts) if parts else None


def prepare_shared(feeler, folder, names):
    shared = {"results": os.path.join(folder, "results"), "databases": []}
    os.makedirs(shared["results"])
    must(feeler, ["run", "--task", "plug", "--policy", "open-loop", "--episodes", "3", "--out",
                  os.path.join(shared["results"], "e.jsonl")])
    if "assemble" in names:
        with open(os.path.join(ROOT, "models/assemblies/crane.json")) as file:
            assembly = json.load(file)
        for task in sorted(set(step["task"] for step in assembly["insertions"])):
            database = os.path.join(folder, task + ".db")
            must(feeler, ["preprocess", "--task", task, "--family", "2x2x2x2", "--out", database])
            shared["databases"].append(database)
    return shared


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--feeler", default=os.path.join(ROOT, "build/feeler"))
    parser.add_argument("--kills", type=int, default=20, help="of each command")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", default="")
    parser.add_argument("--commands", default=",".join(c.name for c in COMMANDS))
    args = parser.parse_args()
    feeler = os.path.abspath(args.feeler)
    names = args.commands.split(",")
    state = {}
    if args.state and os.path.exists(args.state):
        state = json.load(open(args.state))
    folder = tempfile.mkdtemp(prefix="feeler-kills-")
    faults = 0
    try:
        shared = prepare_shared(feeler, folder, names)
        for kind in COMMANDS:
            if kind.name not in names:
                continue
            command = kind(feeler, shared)
            mine = state.setdefault(kind.name, {"next": 0, "killed": 0, "faults": []})
            place = os.path.join(folder, kind.name)
            os.makedirs(place)
            begin = time.time()
            must(feeler, command.arguments(place))
            longest = 1.1 * (time.time() - begin)
            if kind in (Preprocess, Calibrate):
                shutil.rmtree(place)  # these go on where they were: begin anew each time they are through
                os.makedirs(place)
            while mine["next"] < args.kills:
                rng = random.Random("%d/%s/%d" % (args.seed, kind.name, mine["next"]))
                killed, _, fault = kill_once(command, place, longest, rng)
                mine["next"] += 1
                mine["killed"] += killed
                if fault:
                    mine["faults"].append(fault)
                if not killed and kind in (Preprocess, Calibrate):
                    shutil.rmtree(place)
                    os.makedirs(place)
                if args.state:
                    json.dump(state, open(args.state + ".part", "w"))
                    os.replace(args.state + ".part", args.state)
            fault = last_fault(command, place)
            if fault:
                mine["faults"].append(fault)
            faults += len(mine["faults"])
            print(json.dumps({"command": kind.name, "starts": mine["next"], "killed": mine["killed"],
                              "faults": mine["faults"][:5], "longest_s": round(longest, 2)}), flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
