#!/usr/bin/env python3
"""A cell is calibrated through the script that a user uploads, its very text, which dials in (listen:, numbers, token):
the bias of the sensor and the block that the tool touches are found.

  ur_calibrate_test.py BUILD
"""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
DOUBLE = os.path.join(ROOT, "integrations", "ur", "double")
sys.path.insert(0, DOUBLE)
from arm import Arm  # noqa: E402
from controller import Controller  # noqa: E402
from run_double import free_port  # noqa: E402
from urscript import Interpreter  # noqa: E402


def run(build, folder):
    robot_port, own_port = free_port(), free_port()
    out, token = os.path.join(folder, "cell.json"), os.path.join(folder, "token")
    with open(token, "w", opener=lambda path, flags: os.open(path, flags, 0o600)) as file:
        file.write("4711\n")
    with open(os.path.join(ROOT, "integrations", "ur", "feeler_robot.script")) as file:
        script = file.read().replace("LINK_TIMEOUT = 0.1 ", "LINK_TIMEOUT = 10 ")
    assert "TOKEN = 0" in script
    script = script.replace("TOKEN = 0", "TOKEN = 4711")
    simulation = subprocess.Popen(
        [os.path.join(build, "feeler"), "simulate", "--task", "plug", "--listen", f"127.0.0.1:{robot_port}", "--lockstep",
         "--seed", "3", "--no-replay", "--faults", "bias=8"], stderr=subprocess.DEVNULL)
    try:
        arm = Arm("127.0.0.1", robot_port)
        calibrate = subprocess.Popen(
            [os.path.join(build, "feeler"), "cell", "calibrate", "--robot", f"listen:127.0.0.1:{own_port}", "--wire",
             "numbers", "--token-file", token, "--tool", "plug", "--block", "0.635,-0.012,0.1,0.665,0.012,0.2",
             "--top-only", "--start", "--link-timeout", "10", "--json", "--out", out], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        controller = Controller(arm, "127.0.0.1", own_port)
        for _ in Interpreter(script, controller.primitives()).steps():
            if arm.protective or calibrate.poll() is not None:
                break
            controller.tick()
            if controller.socket is None:
                time.sleep(0.0002)
        if controller.socket:
            controller.socket.close()
        said, err = calibrate.communicate(timeout=60)
        arm.bye()
    finally:
        simulation.send_signal(signal.SIGTERM)
        simulation.wait()
    print(said, err, file=sys.stderr)
    if calibrate.returncode != 0:
        return 1
    with open(out) as file:
        cell = json.load(file)
    good = abs(cell["force_bias_n"] - 8.0) < 0.5 and cell["tool"] == "plug" and abs(cell["tool_offset_m"][2]) < 1e-3
    return 0 if good else 1


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as where:
        sys.exit(run(sys.argv[1], where))
