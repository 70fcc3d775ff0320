#!/usr/bin/env python3
"""Mutated files and arguments over whole runs of `feeler`; resumable.

    tests/fuzz/whole_process.py --feeler build/feeler --runs 10000 --seed 1 --state state.json

Law of every run: it ends within the time limit, by itself, with exit code 0, 1 or 2; with 2, standard output is empty
and standard error ends with one printable line `feeler: error: WHERE: WHAT (HOW TO MEND)`; never "internal", never
"terminate called". Run k is drawn from (seed, k) alone. Prints a JSON object; exit code 1 if a law was broken; what
broke one stands in the state file with its command and its input. Needs Python 3.9, nothing else.
"""
import argparse
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MEMORY = 6 << 30
WORDS = [b"0", b"-1", b"1e308", b"nan", b"inf", b"2147483648", b"18446744073709551616", b"null", b'""', b"[]", b"{}",
         b"\xef\xbb\xbf", b"\xff\xfe", b"\x1b[2J", b"\0", b"\r", b"[" * 5000, b"<", b"/>", b'file="/dev/zero"', b"../"]
TEXTS = ["", "0", "-1", "010", "1e308", "nan", "1x", "18446744073709551616", "9" * 400, "x" * 5000, "\x1b[31m",
         "2x2x2", "2..99x2x2", "/dev/null", "/no/such", "/", ".", "é", "--", "--help", "\n"]


TIGER = b"""discount: 0.95
values: reward
states: left right
actions: listen open-left open-right
observations: growl-left growl-right
start: uniform
T: listen
identity
T: open-left
uniform
T: open-right
uniform
O: listen
0.85 0.15
0.15 0.85
O: open-left
uniform
O: open-right
uniform
R: listen : * : * : * -1
R: open-left : left : * : * -100
R: open-left : right : * : * 10
R: open-right : left : * : * 10
R: open-right : right : * : * -100
"""
CLOUD = b"""# .PCD v0.7
VERSION 0.7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH 4
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 4
DATA ascii
0.6 0 0.2
0.61 0 0.2
0.6 0.01 0.2
0.61 0.01 0.21
"""
PYRAMID = b"""o part
v 0 0 0
v 10 0 0
v 0 10 0
v 0 0 10
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
"""
CELL = b'{"format":"feeler cell","version":1,"tool":"plug","stiffness_n_m":60000,"box_min_m":[0,0,0],"box_max_m":[1,1,1]}'


def mutate(data, rng):
    data = bytearray(data)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(7)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at:at] = rng.choice(WORDS)
        elif kind == 2:
            del data[at:at + rng.randint(1, 40)]
        elif kind == 3:
            del data[at:]
        elif kind == 4:
            data[at:at] = data[at:at + rng.randint(1, 60)]
        else:
            digits = [i for i, c in enumerate(data) if chr(c).isdigit()]
            if digits:
                at = rng.choice(digits)
                data[at:at + 1] = rng.choice(WORDS[:7])
    return bytes(data)


class Cases:
    """Sound files, made once, and the commands that read them."""

    def __init__(self, feeler, folder):
        self.feeler = feeler
        self.folder = folder
        self.made = os.path.join(folder, "made")
        os.makedirs(self.made, exist_ok=True)
        self.problem = os.path.join(ROOT, "tests/data/slot2d.json")
        made = lambda name: os.path.join(self.made, name)
        self.sound = {"policy": made("p.json"), "db": made("x.db"), "records": made("e.jsonl"), "other_db": made("y.db"),
                      "shard": made("s1.jsonl"), "other_shard": made("s2.jsonl"), "table": made("t.json")}
        run = ["run", "--task", "plug", "--db", self.sound["db"], "--episodes", "2"]
        calls = [["solve", "--problem", self.problem, "--out", self.sound["policy"]],
                 ["preprocess", "--task", "plug", "--family", "2..3x2x2", "--out", self.sound["db"]],
                 run + ["--out", self.sound["records"]],
                 ["preprocess", "--task", "plug", "--family", "2x2x3", "--out", self.sound["other_db"]],
                 run + ["--shard", "1/2", "--out", self.sound["shard"]],
                 run + ["--shard", "2/2", "--out", self.sound["other_shard"]],
                 ["perceive", "calibrate", "--task", "plug", "--poses", "30", "--installations", "2", "--frames", "1",
                  "--out", self.sound["table"]]]
        for call, file in zip(calls, self.sound.values()):
            if not os.path.exists(file):
                subprocess.run([feeler] + call, check=True, capture_output=True)
        for name, text in {"pomdp": TIGER, "pomdp.pomdp": TIGER, "cloud": CLOUD, "mesh": PYRAMID,
                           "mesh.obj": PYRAMID, "cell": CELL}.items():
            self.sound[name] = made(name)
            with open(self.sound[name], "wb") as file:
                file.write(text)

    def mutated(self, source, name, rng):
        with open(source, "rb") as file:
            data = mutate(file.read(), rng)
        path = os.path.join(self.folder, "now", name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(data)
        return path

    def command(self, rng):
        out = os.path.join(self.folder, "now", "out")
        data = os.path.join(ROOT, "tests/data", rng.choice(["slot2d", "lshape2d", "weighted2d", "pocket3d"]) + ".json")
        case = rng.randrange(17)
        sound = self.sound
        if case == 10:
            return ["solve", "--pomdp", self.mutated(sound["pomdp"], "m.pomdp", rng), "--time-limit", "1", "--out", out]
        if case == 11:
            return ["perceive", "--task", "plug", "--table", sound["table"], "--cloud",
                    self.mutated(sound["cloud"], "c.pcd", rng)]
        if case == 12:
            return ["perceive", "--task", "plug", "--table", self.mutated(sound["table"], "t.json", rng), "--cloud",
                    sound["cloud"]]
        if case == 13:
            return ["task", "import", "--tool", self.mutated(sound["mesh"], "a.obj", rng), "--target", sound["mesh"] +
                    ".obj", "--uncertainty", "6mm,6mm,6mm", "--no-trial", "--out", out]
        if case == 14:
            return ["db", "merge", self.mutated(sound["db"], "x.db", rng), sound["other_db"], "--out", out]
        if case == 15:
            shutil.copyfile(sound["shard"] + ".shard.json", os.path.join(self.folder, "now", "s.jsonl.shard.json"))
            part = rng.choice(["s.jsonl", "s.jsonl.shard.json"])
            shutil.copyfile(sound["shard"], os.path.join(self.folder, "now", "s.jsonl"))
            self.mutated(sound["shard"] + part[7:], part, rng)
            return ["records", "merge", os.path.join(self.folder, "now", "s.jsonl"), sound["other_shard"], "--out", out]
        if case == 16:
            return ["execute", "--task", "plug", "--db", sound["db"], "--robot", "127.0.0.1:1", "--cell",
                    self.mutated(sound["cell"], "cell.json", rng)]
        if case < 2:
            return ["solve", "--problem", self.mutated(data, "p.json", rng), "--time-limit", "1", "--out", out]
        if case == 2:
            return ["export", "--problem", self.mutated(data, "p.json", rng), "--format", rng.choice(["pomdp", "pomdpx"])]
        if case == 3:
            return ["policy", "graph", "--policy", self.mutated(self.sound["policy"], "p.json", rng), "--problem",
                    self.problem]
        if case == 4:
            return ["db", rng.choice(["info", "list", "verify"]), self.mutated(self.sound["db"], "x.db", rng)]
        if case == 5:
            self.mutated(self.sound["records"], "e.jsonl", rng)
            return ["report", os.path.join(self.folder, "now"), "--out", out]
        if case == 6:
            task = os.path.join(ROOT, "models/tasks/plug.xml")
            return ["task", "show", self.mutated(task, "t.xml", rng)]
        line = rng.choice([["solve", "--problem", self.problem, "--out", out, "--seed", "1", "--epsilon", "2", "--gap",
                             "1.2", "--time-limit", "1", "--expansion-limit", "100", "--jobs", "1"],
                            ["export", "--problem", self.problem, "--format", "pomdp", "--out", out, "--discount", "1"],
                            ["db", "show", self.sound["db"], "--extents", "2x2x2"],
                            ["db", "export", self.sound["db"], "--extents", "2x2x2", "--out", out],
                            ["run", "--task", "plug", "--db", self.sound["db"], "--episodes", "1", "--seed", "1",
                             "--extents", "2x2x2", "--noise", "ideal", "--out", out],
                            ["task", "show", "plug", "--opening", "closed"],
                            ["solve", "--pomdp", sound["pomdp"] + ".pomdp", "--precision", "0.1", "--levels", "3",
                             "--time-limit", "1", "--seed", "1"],
                            ["db", "merge", sound["db"], sound["other_db"], "--out", out],
                            ["records", "merge", sound["shard"], sound["other_shard"], "--out", out],
                            ["task", "render", "plug", "--view", "section", "--depth", "1", "--out", out],
                            ["simulate", "--task", "plug", "--listen", "127.0.0.1:99999", "--seed", "1"],
                            ["execute", "--task", "plug", "--db", sound["db"], "--robot", "127.0.0.1:1", "--episodes", "1"],
                            ["experiment", "no-such", "--out", out, "--seed", "1"],
                            ["report", self.made, "--out", out]])
        at = rng.randrange(1, len(line))
        text = rng.choice(TEXTS)
        return line[:at] + [text] + line[at + (rng.random() < 0.8):]


def fault_of(done, seconds, limit):
    if done is None:
        return "no end within %d s" % limit
    if done.returncode not in (0, 1, 2):
        return "exit code %d" % done.returncode
    error = done.stderr.decode("utf-8", "replace")
    if "internal" in error or "terminate called" in error:
        return "an internal error"
    if done.returncode == 2:
        lines = [line for line in error.split("\n") if line]
        if not lines or not lines[-1].startswith("feeler: error: ") or not lines[-1].endswith(")"):
            return "no error line"
        if sum(line.startswith("feeler: error: ") for line in lines) != 1:
            return "several error lines"
        if any(ord(c) < 32 or c == "\ufffd" for c in lines[-1]):
            return "an error line that is not printable"
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--feeler", default=os.path.join(ROOT, "build/feeler"))
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", default="")
    parser.add_argument("--limit", type=int, default=60, help="seconds a run")
    args = parser.parse_args()
    feeler = os.path.abspath(args.feeler)
    state = {"next": 0, "codes": {}, "faults": [], "cpu_s": 0.0}
    if args.state and os.path.exists(args.state):
        with open(args.state) as file:
            state = json.load(file)
    folder = tempfile.mkdtemp(prefix="feeler-fuzz-")
    try:
        cases = Cases(feeler, folder)
        while state["next"] < args.runs:
            k = state["next"]
            rng = random.Random("%d/%d" % (args.seed, k))
            shutil.rmtree(os.path.join(folder, "now"), ignore_errors=True)
            os.makedirs(os.path.join(folder, "now"))
            command = [part.replace("\0", "") for part in cases.command(rng)]
            begin = time.time()
            try:
                done = subprocess.run([feeler] + command, capture_output=True, timeout=args.limit, cwd=folder,
                                      stdin=subprocess.DEVNULL,
                                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)))
            except subprocess.TimeoutExpired:
                done = None
            fault = fault_of(done, time.time() - begin, args.limit)
            code = "none" if done is None else str(done.returncode)
            state["codes"][code] = state["codes"].get(code, 0) + 1
            if fault:
                tail = "" if done is None else done.stderr.decode("utf-8", "replace")[-300:]
                state["faults"].append({"run": k, "fault": fault, "command": [c[:200] for c in command], "tail": tail})
            state["next"] = k + 1
            usage = resource.getrusage(resource.RUSAGE_CHILDREN)
            if args.state and (k % 20 == 0 or fault or k + 1 == args.runs):
                with open(args.state + ".part", "w") as file:
                    json.dump(state, file, indent=1)
                os.replace(args.state + ".part", args.state)
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(json.dumps({"runs": state["next"], "codes": state["codes"], "faults": len(state["faults"]),
                          "cpu_s_this_call": round(usage.ru_utime + usage.ru_stime, 1)}))
        for fault in state["faults"][:20]:
            print(json.dumps(fault), file=sys.stderr)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if state["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
