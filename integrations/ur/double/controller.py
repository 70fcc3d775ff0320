"""A double of the controller: what the script's functions do, on the simulated arm of `feeler simulate --lockstep`.

Each controller step (2 ms) is one twist of that length; movel and movej follow a trapezoidal speed profile along the
straight line; stopl ends with the arm held where it is; force mode is an admittance (speed proportional to the force that
is missing, within the speed limits of force_mode). What a real controller does differently: docs/robot-protocol.md.
"""
import math
import select
import socket

import numpy as np

from urscript import Pose

STEP = 0.002
GAIN = 1.0e-4  # m/s per N, of the admittance


def rotation(v):
    angle = math.sqrt(sum(c * c for c in v))
    if angle < 1e-12:
        return np.eye(3)
    k = np.array(v, float) / angle
    skew = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew


def rotation_vector(r):
    angle = math.acos(max(-1.0, min(1.0, (np.trace(r) - 1) / 2)))
    if angle < 1e-9:
        return np.zeros(3)
    if math.pi - angle < 1e-6:
        column = int(np.argmax(np.diag(r)))
        axis = (r[:, column] + np.eye(3)[:, column])
        return math.pi * axis / np.linalg.norm(axis)
    return angle / (2 * math.sin(angle)) * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])


class Controller:
    """`arm`: a client of the simulated robot (arm.py)."""

    def __init__(self, arm, host, port, patience_s=5.0):
        self.arm, self.address, self.patience_s = arm, (host, port), patience_s
        self.socket, self.buffer, self.closed = None, b"", False
        self.twist = None  # wanted in this step, base axes: linear, angular
        self.zero = np.zeros(6)
        self.quiet_steps = 0
        self.log = []

    # ---- state
    def pose(self):
        return self.arm.position(), self.arm.rotation()

    def wrench(self):
        return self.arm.wrench()

    # ---- a step of the controller, after all threads had their turn
    def tick(self):
        if self.twist is None:
            self.arm.rest(STEP)
        else:
            self.arm.twist(self.twist[0], self.twist[1], STEP)
        self.twist = None

    # ---- motions: generators that yield once a step
    def movel(self, goal, acceleration=1.2, speed=0.25):
        start, r0 = self.pose()
        end, r1 = np.array(goal[:3], float), rotation(goal[3:])
        turn = rotation_vector(r1 @ r0.T)
        length = float(np.linalg.norm(end - start))
        angle = float(np.linalg.norm(turn))
        whole = max(length, 0.1 * angle, 1e-9)
        ramp = min(speed / acceleration, math.sqrt(whole / acceleration))
        top = acceleration * ramp
        cruise = max(0.0, (whole - top * ramp) / top)
        t, duration = 0.0, 2 * ramp + cruise

        def progress(at):
            if at <= 0:
                return 0.0, 0.0
            if at < ramp:
                return 0.5 * acceleration * at * at, acceleration * at
            if at < ramp + cruise:
                return 0.5 * top * ramp + top * (at - ramp), top
            left = max(0.0, duration - at)
            return whole - 0.5 * acceleration * left * left, acceleration * left

        settle = 0
        while True:
            here, r = self.pose()
            done, rate = progress(t + STEP)
            share, pace = done / whole, rate / whole
            where = start + share * (end - start)
            aim = rotation(share * turn) @ r0
            linear = pace * (end - start) + 20.0 * (where - here)
            angular = pace * turn + 20.0 * rotation_vector(aim @ r.T)
            self.twist = (linear, angular)
            yield
            t += STEP
            if t >= duration:
                here, r = self.pose()
                settle += 1
                if (np.linalg.norm(here - end) < 3e-5 and settle > 5) or settle > 150:
                    return

    def movej(self, goal, *_):
        yield from self.movel(goal, 1.0, 0.25)

    def stopl(self, *_):
        self.arm.hold()
        yield

    def sync(self):
        yield

    def sleep(self, seconds):
        for _ in range(max(1, round(seconds / STEP))):
            yield

    # ---- force mode
    def force_mode(self, frame, compliant, wrench, kind, limits):
        self.force_task = (rotation(frame[3:]), np.array(compliant[:3], float), np.array(wrench[:3], float),
                           np.array(limits[:3], float))

    def push(self):
        axes, compliant, wanted, limits = self.force_task
        felt = axes.T @ np.array(self.wrench()[:3])
        speed = np.clip(GAIN * (wanted + felt), -limits, limits) * compliant
        self.twist = (axes @ speed, np.zeros(3))

    def end_force_mode(self):
        self.force_task = None

    force_task = None

    # ---- the wire
    def socket_open(self, host, port, name):
        del host, port, name  # of the cell; the double dials where it is told
        try:
            self.socket = socket.create_connection(self.address, timeout=2.0)
        except OSError:
            return False
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.buffer, self.closed, self.quiet_steps = b"", False, 0
        return True

    def socket_close(self, name):
        if self.socket:
            self.socket.close()
        self.socket = None

    def socket_send_line(self, text, name):
        try:
            self.socket.sendall(text.encode() + b"\n")
        except OSError:
            self.closed = True

    def _line(self, wait_s):
        while b"\n" not in self.buffer and not self.closed:
            ready, _, _ = select.select([self.socket], [], [], wait_s)
            if not ready:
                return None
            try:
                got = self.socket.recv(4096)
            except OSError:
                got = b""
            if not got:
                self.closed = True
            self.buffer += got
        line, found, rest = self.buffer.partition(b"\n")
        if not found:
            return None
        self.buffer = rest
        return line.decode(errors="replace")

    def socket_read_ascii_float(self, most, name, timeout):
        # The link is sound: this controller's time waits for the other end where it would run ahead of its heartbeats.
        self.quiet_steps += 1
        wait_s = timeout if timeout > 1.0 else (self.patience_s if self.quiet_steps > 20 else 0.0)
        line = self._line(wait_s)
        if line is None:
            return [-1 if self.closed else 0]
        self.quiet_steps = 0
        try:
            numbers = [float(n) for n in line.strip()[1:-1].split(",")]
        except ValueError:
            return [0]
        return [len(numbers)] + [int(n) if n == int(n) else n for n in numbers[:most]]

    # ---- what the script may call
    def primitives(self):
        def text(value):
            if isinstance(value, bool):
                return "True" if value else "False"
            return str(value) if isinstance(value, int) else f"{value:.6f}"

        def tcp_pose():
            p, r = self.pose()
            return Pose(list(p) + list(rotation_vector(r)))

        def zero():
            self.arm.zero()

        return {
            "movel": self.movel, "movej": self.movej, "stopl": self.stopl, "sync": self._sync, "sleep": self.sleep,
            "get_inverse_kin": lambda pose: pose, "get_actual_tcp_pose": tcp_pose,
            "get_actual_joint_positions": lambda: list(self.arm.state["joints"]),
            "get_tcp_force": lambda: list(self.wrench()),
            "force": lambda: float(np.linalg.norm(self.wrench()[:3])),
            "zero_ftsensor": zero, "set_payload": lambda *a: None,
            "force_mode": self.force_mode, "end_force_mode": self.end_force_mode,
            "socket_open": self.socket_open, "socket_close": self.socket_close,
            "socket_send_line": self.socket_send_line, "socket_read_ascii_float": self.socket_read_ascii_float,
            "to_str": text, "str_cat": lambda a, b: a + b, "norm": lambda v: math.sqrt(sum(c * c for c in v)),
            "sqrt": math.sqrt, "atan2": math.atan2,
        }

    def _sync(self):
        if self.force_task is not None:
            self.push()
        yield
