#!/usr/bin/env python3
"""Runs feeler_robot.script, its very text, on the simulated arm, with feeler-execute at the other end.

  run_double.py --build build --db out/plug.db --task plug --extents 3x3x3 --episodes 100 --seed 3

Prints a JSON summary; exit code 0 if every episode ended inserted (as the simulation judges it).
"""
import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import time

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from arm import Arm  # noqa: E402
from controller import Controller, rotation_vector  # noqa: E402
from urscript import Interpreter  # noqa: E402


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def estimate_text(pose):
    rows = np.array(pose).reshape(3, 4)
    turn = rotation_vector(rows[:, :3])
    angle = np.linalg.norm(turn)
    axis = turn / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    quaternion = [np.cos(angle / 2)] + list(np.sin(angle / 2) * axis)
    return ",".join(f"{v:.12f}" for v in list(rows[:, 3]) + quaternion)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", help="folder with feeler and feeler-execute")
    parser.add_argument("--script", default=os.path.join(os.path.dirname(__file__), "..", "feeler_robot.script"))
    parser.add_argument("--db", required=True)
    parser.add_argument("--task", default="plug")
    parser.add_argument("--extents", default="3x3x3")
    parser.add_argument("--episodes", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--link-timeout", type=float, default=0.1,
                        help="s, the script's LINK_TIMEOUT: more where the double may be kept waiting (default: as it is)")
    parser.add_argument("--out", help="records, one JSON object a line")
    options = parser.parse_args()
    with open(options.script) as file:
        script = file.read().replace("LINK_TIMEOUT = 0.1 ", f"LINK_TIMEOUT = {options.link_timeout:g} ")
    robot_port, execute_port = free_port(), free_port()
    simulation = subprocess.Popen(
        [os.path.join(options.build, "feeler"), "simulate", "--task", options.task, "--listen",
         f"127.0.0.1:{robot_port}", "--lockstep", "--seed", str(options.seed), "--extents", options.extents,
         "--episodes", str(options.episodes), "--no-replay"], stderr=subprocess.DEVNULL)
    results = []
    try:
        arm = Arm("127.0.0.1", robot_port)
        for number in range(options.episodes):
            told = arm.episode(number)
            command = [os.path.join(options.build, "feeler-execute"), "--db", options.db, "--robot",
                       f"listen:127.0.0.1:{execute_port}", "--wire", "numbers", "--estimate",
                       estimate_text(told["estimate"]), "--extents", options.extents, "--start", "--json",
                       "--heartbeat", "0.004", "--link-timeout", f"{options.link_timeout:g}"]
            if options.out:
                command += ["--out", f"{options.out}.{number}"]
            execute = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            controller = Controller(arm, "127.0.0.1", execute_port)
            interpreter = Interpreter(script, controller.primitives())
            for _ in interpreter.steps():
                if arm.protective:
                    break  # a controller in a protective stop runs no program
                controller.tick()
                if controller.socket is None:
                    if execute.poll() is not None:
                        break
                    time.sleep(0.0002)
            if controller.socket:
                controller.socket.close()
            out, err = execute.communicate(timeout=60)
            arm.hold()
            verdict = arm.verdict()
            summary = json.loads(out) if out.strip() else {"failures": {err.strip(): 1}}
            results.append({"episode": number, "inserted": verdict["inserted"],
                            "believed": summary.get("believed_inserted", 0) == 1, "peak_force_n": verdict["peak_force_n"],
                            "forbidden_contacts": verdict["forbidden_contacts"],
                            "robot_time_s": summary.get("robot_time_s"), "failures": summary.get("failures")})
            print(json.dumps(results[-1]), file=sys.stderr, flush=True)
        arm.bye()
    finally:
        simulation.send_signal(signal.SIGTERM)
        simulation.wait()
    inserted = sum(r["inserted"] for r in results)
    print(json.dumps({"episodes": len(results), "inserted": inserted,
                      "peak_force_max_n": max((r["peak_force_n"] for r in results), default=0.0),
                      "forbidden_contacts": sum(r["forbidden_contacts"] for r in results)}))
    return 0 if inserted == len(results) == options.episodes else 1


if __name__ == "__main__":
    sys.exit(main())
