#!/usr/bin/env python3
"""A ROS 2 cell behind feeler's wire protocol: an rclpy node that streams Cartesian twists to a servo node until a contact.

Topics and services, all by parameters:
  pose    geometry_msgs/PoseStamped    of the tool reference in the base frame, as the cell's state broadcaster says it
  wrench  geometry_msgs/WrenchStamped  of the world on the tool, base axes, gravity compensated
  twist   geometry_msgs/TwistStamped   to MoveIt Servo or a Cartesian controller, base axes
  zero    std_srvs/Trigger             of the force sensor
  stop    std_msgs/Bool                the cell's protective stop; true: it stands
  joints  sensor_msgs/JointState       optional, of the arm alone, in the order from the base outwards

  ros2 run ... or: python3 feeler_ros2.py --listen 127.0.0.1:7802 [--token-file FILE] [--ros-args -r pose:=/tcp_pose ...]
Never run on hardware: the node is exercised against a double of the rclpy calls it makes (fake_ros.py).
"""
import argparse
import os
import sys
import threading
import time

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "python"))
import feeler_robot  # noqa: E402
from ur_rtde_bridge import rotation, rotation_vector  # noqa: E402

PERIOD_S = 0.004
ACCELERATION = 0.5  # m/s^2
ARRIVED_M = 5e-5
GAIN = 1.0e-4       # m/s per N: compliant motions are an admittance


def rotation_of(q):
    w, x, y, z = np.array([q.w, q.x, q.y, q.z]) / np.linalg.norm([q.w, q.x, q.y, q.z])
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class RosDriver:
    name = "ROS 2 cell"
    capabilities = {"motions": list(feeler_robot.MOTIONS), "payload_kg": 5.0, "force_noise_n": 0.6,
                    "contact_force_n": 6.0, "reaction_time_s": 0.02, "effective_mass_kg": 25.0, "stopping_time_s": 0.5,
                    "max_speed_m_s": 0.25, "max_force_n": 60.0, "workspace_min_m": [-1.3, -1.3, -0.3],
                    "workspace_max_m": [1.3, 1.3, 1.5]}

    def __init__(self, node, messages, sleep=time.sleep):
        """`messages`: the message classes, by name (so that a double can stand for them)."""
        self.node, self.messages, self.sleep = node, messages, sleep
        self._pose, self._wrench, self._stopped = None, np.zeros(6), False
        self._offset = np.zeros(6)
        node.create_subscription(messages["PoseStamped"], "pose", self._on_pose, 10)
        node.create_subscription(messages["WrenchStamped"], "wrench", self._on_wrench, 10)
        node.create_subscription(messages["Bool"], "stop", self._on_stop, 10)
        self._joints = None
        if "JointState" in messages:
            node.create_subscription(messages["JointState"], "joints", self._on_joints, 10)
        self.publisher = node.create_publisher(messages["TwistStamped"], "twist", 10)
        self.began = time.monotonic()

    def _on_pose(self, message):
        pose = np.eye(4)
        p = message.pose.position
        pose[:3, 3] = [p.x, p.y, p.z]
        pose[:3, :3] = rotation_of(message.pose.orientation)
        self._pose = pose

    def _on_wrench(self, message):
        f, t = message.wrench.force, message.wrench.torque
        self._wrench = np.array([f.x, f.y, f.z, t.x, t.y, t.z])

    def _on_stop(self, message):
        self._stopped = bool(message.data)

    def _on_joints(self, message):
        self._joints = list(message.position)

    def joints(self):
        return self._joints

    def ready(self):
        return self._pose is not None

    def pose(self):
        return self._pose.copy()

    def wrench(self):
        return list(self._wrench - self._offset)

    def time(self):
        return time.monotonic() - self.began

    def zero(self):
        self._offset = self._wrench.copy()

    def protective_stopped(self):
        return self._stopped

    def recover(self):
        if self._stopped:
            raise ValueError("clear the protective stop in the cell first")

    def _twist(self, linear, angular=(0.0, 0.0, 0.0)):
        message = self.messages["TwistStamped"]()
        message.header.stamp = self.node.get_clock().now().to_msg()
        message.header.frame_id = "base_link"
        message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = (float(v) for v in linear)
        message.twist.angular.x, message.twist.angular.y, message.twist.angular.z = (float(v) for v in angular)
        self.publisher.publish(message)

    def _watched(self, goal, speed, limit, stops_for_good):
        begin = self.pose()
        way = goal[:3, 3] - begin[:3, 3]
        length = np.linalg.norm(way)
        released = np.linalg.norm(self.wrench()[:3]) <= limit
        peak, pace = 0.0, 0.0
        patience_s = 5.0 + 4.0 * length / speed
        end = time.monotonic() + patience_s
        try:
            while True:
                here = self.pose()
                left = goal[:3, 3] - here[:3, 3]
                far = np.linalg.norm(left)
                turn = rotation_vector(goal[:3, :3] @ here[:3, :3].T)
                if far < ARRIVED_M and np.linalg.norm(turn) < 1e-3:
                    return "reached", False, peak, here, ""
                if time.monotonic() > end:
                    return "time_limit", False, peak, here, "the cell did not bring the tool there"
                pace = min(pace + ACCELERATION * PERIOD_S, speed, np.sqrt(2 * ACCELERATION * far), far / (2 * PERIOD_S))
                self._twist(pace * left / max(far, 1e-9), 2.0 * turn)
                yield
                self.sleep(PERIOD_S)
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
        finally:
            self._twist((0.0, 0.0, 0.0))

    def transfer(self, goal):
        # Along a straight line: the cell must leave it free. Replace by the cell's MoveIt plan where there are obstacles.
        return (yield from self._watched(goal, 0.25, 20.0, True))

    def linear(self, goal, speed, force):
        return (yield from self._watched(goal, speed, force, False))

    def guarded(self, direction, distance, speed, force):
        goal = self.pose()
        goal[:3, 3] += distance * direction
        return (yield from self._watched(goal, speed, force, False))

    def compliant(self, poses, speed, force, time_limit, stiffness, rotational_stiffness):
        del stiffness, rotational_stiffness
        peak, ended = 0.0, "reached"
        end = time.monotonic() + time_limit
        try:
            for goal in poses:
                begin = self.pose()[:3, 3]
                way = goal[:3, 3] - begin
                length = np.linalg.norm(way)
                if length < 1e-4:
                    continue
                z = way / length
                best, moved = 0.0, time.monotonic()
                while True:
                    felt = np.array(self.wrench()[:3])
                    along = np.clip(GAIN * (0.8 * force + felt @ z), -speed, speed)
                    across = np.clip(GAIN * (felt - (felt @ z) * z), -0.05, 0.05)
                    self._twist(along * z + across)
                    yield
                    self.sleep(PERIOD_S)
                    done = float((self.pose()[:3, 3] - begin) @ z)
                    size = float(np.linalg.norm(self.wrench()[:3]))
                    peak = max(peak, size)
                    if done > best + 5e-5:
                        best, moved = done, time.monotonic()
                    if done >= length:
                        break
                    if size > force:
                        return "force_limit", True, peak, self.pose(), ""
                    if time.monotonic() > end:
                        return "time_limit", False, peak, self.pose(), ""
                    if time.monotonic() - moved > 0.4:
                        ended = "contact"
                        break
        finally:
            self._twist((0.0, 0.0, 0.0))
        return ended, ended == "contact", peak, self.pose(), ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--listen", default="127.0.0.1:7802")
    parser.add_argument("--token-file")
    options, ros_arguments = parser.parse_known_args()
    import rclpy
    from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Bool

    rclpy.init(args=ros_arguments)
    node = rclpy.create_node("feeler_robot")
    driver = RosDriver(node, {"PoseStamped": PoseStamped, "WrenchStamped": WrenchStamped, "TwistStamped": TwistStamped,
                              "Bool": Bool, "JointState": JointState})
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    while not driver.ready():
        time.sleep(0.1)
    token = open(options.token_file).readline().strip() if options.token_file else ""
    host, port = options.listen.rsplit(":", 1)
    feeler_robot.Server(driver, token).serve(feeler_robot.listen(host, int(port), token))


if __name__ == "__main__":
    main()
