"""The simulated arm behind `feeler simulate --lockstep`, a step at a time: a client of the JSON form of the protocol."""
import json
import socket
import time

import numpy as np


class Arm:
    def __init__(self, host, port, connect_s=60.0):
        end = time.monotonic() + connect_s
        while True:
            try:
                self.socket = socket.create_connection((host, port), timeout=120.0)
                break
            except OSError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.05)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.file = self.socket.makefile("r")
        self.seq = 0
        self.state = None
        self.protective = False
        self.held = True
        self._ask({"type": "hello", "version": 1, "units": "m kg s rad N", "client": "ur double", "token": ""}, 0)
        self._ask({"type": "start"})

    def _ask(self, message, seq=None):
        if seq is None:
            self.seq += 1
            seq = self.seq
        message["seq"] = seq
        self.socket.sendall(json.dumps(message).encode() + b"\n")
        reply = json.loads(self.file.readline())
        if reply["type"] == "error":
            raise RuntimeError(reply["code"] + ": " + reply["text"])
        self.state = reply.get("state", self.state)
        return reply

    def episode(self, number):
        self.protective, self.held = False, True
        return self._ask({"type": "episode", "episode": number})

    def verdict(self):
        return self._ask({"type": "verdict"})

    def bye(self):
        self.seq += 1
        self.socket.sendall(json.dumps({"type": "bye", "seq": self.seq}).encode() + b"\n")

    def position(self):
        p = self.state["pose"]
        return np.array([p[3], p[7], p[11]])

    def rotation(self):
        return np.array(self.state["pose"]).reshape(3, 4)[:, :3]

    def wrench(self):
        return self.state["wrench"]

    def zero(self):
        self._ask({"type": "zero"})
        self.held = True

    def twist(self, linear, angular, duration):
        """A velocity of the tool in base axes."""
        r = self.rotation()
        identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
        result = self._ask({"type": "twist", "tool_T_frame": identity, "linear_m_s": list(r.T @ linear),
                            "angular_rad_s": list(r.T @ angular), "duration_s": duration, "contact_force_n": 1e6})
        self.held = False
        if result["reason"] == "aborted":
            self.protective = True

    def hold(self):
        """At rest where it is."""
        result = self._ask({"type": "linear", "pose": self.state["pose"], "speed_m_s": 0.1, "contact_force_n": 1e6})
        self.held = True
        if result["reason"] == "aborted":
            self.protective = True

    def rest(self, duration):
        """A step without motion: the simulated clock stands still while the arm rests."""
        if not self.held:
            self.hold()
