#!/usr/bin/env python3
"""Law: the script that a user uploads, its very text, brings an episode on the simulated arm to an insertion.

  ur_script_test.py BUILD [EPISODES]
"""
import os
import subprocess
import sys
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
build = sys.argv[1]
episodes = sys.argv[2] if len(sys.argv) > 2 else "1"
with tempfile.TemporaryDirectory() as folder:
    db = os.path.join(folder, "plug.db")
    subprocess.run([os.path.join(build, "feeler"), "preprocess", "--task", "plug", "--out", db, "--family", "3x3x3"],
                   check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    sys.exit(subprocess.run([sys.executable, os.path.join(ROOT, "integrations", "ur", "double", "run_double.py"), "--build",
                             build, "--db", db, "--extents", "3x3x3", "--episodes", episodes, "--seed", "3",
                             "--link-timeout", "10"]).returncode)
