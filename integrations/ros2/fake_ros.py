"""A double of the rclpy calls that feeler_ros2.py makes: a node whose topics end in the world of fake_rtde.World."""
import threading
import time
from types import SimpleNamespace as Space

import numpy as np


def message(**parts):
    return type("Message", (Space,), {"__init__": lambda self: Space.__init__(self, **{k: make() for k, make in parts.items()})})


def xyz():
    return Space(x=0.0, y=0.0, z=0.0)


MESSAGES = {
    "PoseStamped": message(header=Space, pose=lambda: Space(position=xyz(), orientation=Space(w=1.0, x=0.0, y=0.0, z=0.0))),
    "WrenchStamped": message(header=Space, wrench=lambda: Space(force=xyz(), torque=xyz())),
    "TwistStamped": message(header=Space, twist=lambda: Space(linear=xyz(), angular=xyz())),
    "Bool": message(data=bool), "JointState": message(position=list),
}


class FakeNode:
    """Publishes pose and wrench every 2 ms and moves by the last twist; a twist older than 0.1 s counts as none."""

    def __init__(self, world):
        self.world, self.subscribers = world, {}
        self.twist, self.twist_at = np.zeros(3), 0.0
        self.twists = 0
        self.lock = threading.Lock()

    def create_subscription(self, kind, topic, callback, depth):
        self.subscribers[topic] = (kind, callback)

    def create_publisher(self, kind, topic, depth):
        return Space(publish=self._on_twist)

    def get_clock(self):
        return Space(now=lambda: Space(to_msg=time.monotonic))

    def _on_twist(self, m):
        with self.lock:
            v = m.twist.linear
            self.twist, self.twist_at = np.array([v.x, v.y, v.z]), time.monotonic()
            self.twists += 1

    def spin(self, stopping):
        last = time.monotonic()
        while not stopping.is_set():
            now = time.monotonic()
            with self.lock:
                velocity = self.twist if now - self.twist_at < 0.1 else np.zeros(3)
            self.world.position = self.world.position + min(now - last, 0.01) * velocity
            last = now
            pose = MESSAGES["PoseStamped"]()
            pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = self.world.position
            self.subscribers["pose"][1](pose)
            wrench = MESSAGES["WrenchStamped"]()
            force = self.world.force() + self.world.offset
            wrench.wrench.force.x, wrench.wrench.force.y, wrench.wrench.force.z = force
            self.subscribers["wrench"][1](wrench)
            stop = MESSAGES["Bool"]()
            stop.data = self.world.protective
            self.subscribers["stop"][1](stop)
            time.sleep(0.002)
