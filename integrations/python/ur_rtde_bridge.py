#!/usr/bin/env python3
"""A Universal Robots arm over ur_rtde behind feeler's wire protocol (JSON form).

  ur_rtde_bridge.py --ur 192.168.56.101 --listen 127.0.0.1:7801 [--token-file FILE]

then, on the same computer: feeler execute --robot 127.0.0.1:7801 ...
Never run on hardware: its calls of ur_rtde are exercised against a double (fake_rtde.py). Read docs/safety.md first.
"""
import argparse
import time

import numpy as np

import feeler_robot

STEP_S = 0.004


def rotation(v):
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.eye(3)
    k = np.asarray(v, float) / angle
    skew = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def rotation_vector(r):
    angle = np.arccos(np.clip((np.trace(r) - 1) / 2, -1.0, 1.0))
    if angle < 1e-9:
        return np.zeros(3)
    if np.pi - angle < 1e-6:
        column = int(np.argmax(np.diag(r)))
        axis = r[:, column] + np.eye(3)[:, column]
        return np.pi * axis / np.linalg.norm(axis)
    return angle / (2 * np.sin(angle)) * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])


def pose_of(six):
    pose = np.eye(4)
    pose[:3, 3] = six[:3]
    pose[:3, :3] = rotation(six[3:])
    return pose


def six_of(pose):
    return [float(v) for v in pose[:3, 3]] + [float(v) for v in rotation_vector(pose[:3, :3])]


class UrDriver:
    """`control` and `receive` are ur_rtde's RTDEControlInterface and RTDEReceiveInterface."""

    name = "Universal Robots arm, ur_rtde"
    capabilities = {"motions": list(feeler_robot.MOTIONS), "payload_kg": 10.0, "force_noise_n": 0.6,
                    "contact_force_n": 6.0, "reaction_time_s": 0.012, "effective_mass_kg": 25.0, "stopping_time_s": 0.3,
                    "max_speed_m_s": 0.25, "max_force_n": 80.0, "workspace_min_m": [-1.3, -1.3, -0.3],
                    "workspace_max_m": [1.3, 1.3, 1.5]}

    def __init__(self, control, receive, sleep=time.sleep):
        self.control, self.receive, self.sleep = control, receive, sleep

    def pose(self):
        return pose_of(self.receive.getActualTCPPose())

    def wrench(self):
        return self.receive.getActualTCPForce()

    def joints(self):
        return self.receive.getActualQ()

    def time(self):
        return self.receive.getTimestamp()

    def zero(self):
        self.control.zeroFtSensor()
        self.sleep(0.05)

    def protective_stopped(self):
        return self.receive.isProtectiveStopped()

    def recover(self):
        """Unlocking is the operator's, on the pendant: here only the script is uploaded again."""
        if self.receive.isProtectiveStopped():
            raise ValueError("unlock the protective stop on the pendant first")
        self.control.reuploadScript()

    def _watched(self, goal, speed, limit, stops_for_good):
        begin = self.pose()
        way = goal[:3, 3] - begin[:3, 3]
        length = np.linalg.norm(way)
        released = np.linalg.norm(self.wrench()[:3]) <= limit
        peak, arrived = 0.0, False
        if not self.control.moveL(six_of(goal), speed, 1.0, True):  # asynchronous
            return "unplanned", False, 0.0, None, "moveL refused the pose"
        try:
            while True:
                yield
                self.sleep(STEP_S)
                force = np.array(self.wrench()[:3])
                size = np.linalg.norm(force)
                peak = max(peak, size)
                if size <= limit:
                    released = True
                elif released or (length > 0 and force @ way < 0.5 * size * length):
                    touch = self.pose()
                    if stops_for_good:
                        return "aborted", True, peak, touch, "protective stop: contact during a transfer"
                    return "contact", True, peak, touch, ""
                if self.control.getAsyncOperationProgress() < 0:
                    arrived = True
                    return "reached", False, peak, self.pose(), ""
        finally:
            if not arrived:
                self.control.stopL(4.0)

    def transfer(self, goal):
        # Through a straight line: the cell must leave it free. Obstacles are for a planner of the cell.
        return (yield from self._watched(goal, 0.25, 20.0, True))

    def linear(self, goal, speed, force):
        return (yield from self._watched(goal, speed, force, False))

    def guarded(self, direction, distance, speed, force):
        goal = self.pose()
        goal[:3, 3] += distance * direction
        return (yield from self._watched(goal, speed, force, False))

    def compliant(self, poses, speed, force, time_limit, stiffness, rotational_stiffness):
        del stiffness, rotational_stiffness  # force mode has none: the controller's own
        peak, spent, ended = 0.0, 0.0, "reached"
        try:
            for goal in poses:
                begin = self.pose()[:3, 3]
                way = goal[:3, 3] - begin
                length = np.linalg.norm(way)
                if length < 1e-4:
                    continue
                z = way / length
                x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
                x /= np.linalg.norm(x)
                frame = np.eye(4)
                frame[:3, :3] = np.column_stack([x, np.cross(z, x), z])
                frame[:3, 3] = begin
                best, resting = 0.0, 0.0
                while True:
                    self.control.forceMode(six_of(frame), [1, 1, 1, 0, 0, 0], [0, 0, 0.8 * force, 0, 0, 0], 2,
                                           [0.05, 0.05, speed, 0.1, 0.1, 0.1])
                    yield
                    self.sleep(STEP_S)
                    spent += STEP_S
                    done = float((self.pose()[:3, 3] - begin) @ z)
                    size = float(np.linalg.norm(self.wrench()[:3]))
                    peak = max(peak, size)
                    resting = 0.0 if done > best + 5e-5 else resting + STEP_S
                    best = max(best, done)
                    if done >= length:
                        break
                    if size > force:
                        return "force_limit", True, peak, self.pose(), ""
                    if spent > time_limit:
                        return "time_limit", False, peak, self.pose(), ""
                    if resting > 0.4:
                        ended = "contact"
                        break
        finally:
            self.control.forceModeStop()
            self.control.stopL(4.0)
        return ended, ended == "contact", peak, self.pose(), ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ur", required=True, help="address of the controller")
    parser.add_argument("--listen", default="127.0.0.1:7801")
    parser.add_argument("--token-file")
    options = parser.parse_args()
    import rtde_control
    import rtde_receive

    token = open(options.token_file).readline().strip() if options.token_file else ""
    host, port = options.listen.rsplit(":", 1)
    listener = feeler_robot.listen(host, int(port), token)
    driver = UrDriver(rtde_control.RTDEControlInterface(options.ur), rtde_receive.RTDEReceiveInterface(options.ur))
    feeler_robot.Server(driver, token).serve(listener)


if __name__ == "__main__":
    main()
