#!/usr/bin/env python3
"""Laws of the wire at size: in lockstep the records are those of one process, byte for byte but `timing`; with faults of
every kind ordered, every episode ends inserted or with the true reason, nothing that must not be touched is, no motion is
asked for after a lost link or a protective stop, and the force budget holds.

  wire_campaign.py BUILD [EQUAL [FAULTY]]      episodes, 300 and 1000 where they are left out; prints JSON
"""

import json
import os
import socket
import subprocess
import sys
import tempfile

FAULTS = "drop=0.08,stall=0.2,stall-ms=50,protective=0.06,malformed=0.06,half=0.06,version=0.03,nan=0.05,backwards=0.05,jump=0.05"
SEED = "31"


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def untimed(path):
    with open(path) as file:
        records = [json.loads(line) for line in file]
    for record in records:
        del record["timing"]
    return records


class Campaign:
    def __init__(self, build, folder):
        self.feeler, self.folder = os.path.join(build, "feeler"), folder
        self.db = os.path.join(folder, "plug.db")
        self.call("preprocess", "--task", "plug", "--out", self.db)

    def call(self, *arguments):
        done = subprocess.run([self.feeler, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{arguments[0]}: {done.stderr.strip().splitlines()[-1:]}")
        return done.stdout

    def over_the_wire(self, episodes, out, *faults):
        address = f"127.0.0.1:{free_port()}"
        simulation = subprocess.Popen(
            [self.feeler, "simulate", "--task", "plug", "--listen", address, "--lockstep", "--json", "--db", self.db, "--seed", SEED, "--episodes", str(episodes), *faults],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            summary = json.loads(self.call("execute", "--db", self.db, "--robot", address, "--out", out, "--json"))
        finally:
            simulation.terminate()
            seen = simulation.communicate()[0]
        return summary, json.loads(seen)

    def equal(self, episodes):
        direct, wire = os.path.join(self.folder, "direct.jsonl"), os.path.join(self.folder, "wire.jsonl")
        self.call("run", "--task", "plug", "--db", self.db, "--seed", SEED, "--episodes", str(episodes), "--out", direct)
        self.over_the_wire(episodes, wire)
        one, other = untimed(direct), untimed(wire)
        return sum(a == b for a, b in zip(one, other)) if len(one) == len(other) == episodes else 0

    def faulty(self, episodes):
        out = os.path.join(self.folder, "faulty.jsonl")
        summary, seen = self.over_the_wire(episodes, out, "--faults", FAULTS)
        records = untimed(out)
        inserted = [r for r in records if r["inserted"]]
        known = ("link lost", "protective stop", "refused the session", "from the start pose")  # the last: a pose that jumped
        unknown = [r["reason"] for r in records if not r["inserted"] and not any(k in r["reason"] for k in known)]
        return {"episodes": len(records), "inserted": len(inserted), "unexplained": unknown,
                "forbidden_contacts": sum(r["forbidden_contacts"] or 0 for r in records),
                "motions_after_a_stop": seen["refused_motions"], "faults": seen["faults"],
                "budget_passed": sum(r["budget_passings"] > 0 for r in records),
                "peak_force_max_n": max(r["peak_force_n"] for r in records), "links_lost": summary["links_lost"]}


def main():
    build = sys.argv[1]
    equal = int(sys.argv[2]) if len(sys.argv) > 2 else 300
    faulty = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(build, folder)
        result = {"equal": campaign.equal(equal), "of": equal, "faulty": campaign.faulty(faulty)}
    print(json.dumps(result, indent=1))
    bad = result["faulty"]
    good = (result["equal"] == equal and bad["episodes"] == faulty and not bad["unexplained"] and
            bad["forbidden_contacts"] == 0 and bad["motions_after_a_stop"] == 0)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
