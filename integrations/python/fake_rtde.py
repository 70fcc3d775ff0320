"""A double of the calls of ur_rtde that ur_rtde_bridge.py makes: a point over a block and a floor, in wall time.

Contacts are springs: a point that stands d metres inside gets stiffness * d N out of the nearest face.
"""
import time

import numpy as np


class World:
    def __init__(self, start=(0.0, 0.0, 0.3), block=((0.45, -0.05, 0.0), (0.55, 0.05, 0.1)), stiffness=20000.0,
                 tip=(0.0, 0.0, 0.0), bias=(0.0, 0.0, 0.0), noise=0.0):
        self.position, self.turn = np.array(start, float), np.zeros(3)
        self.low, self.high = np.array(block[0]), np.array(block[1])
        self.stiffness, self.tip = stiffness, np.array(tip, float)
        self.offset = np.array(bias, float)
        self.noise, self.random = noise, np.random.default_rng(1)
        self.goal, self.speed, self.push = None, 0.0, None
        self.begin = self.last = time.monotonic()
        self.protective = False
        self.moves = 0

    def force(self):
        p = self.position + self.tip
        out = np.zeros(3)
        if p[2] < 0.0:
            out[2] += -p[2] * self.stiffness
        if (p > self.low).all() and (p < self.high).all():
            depths = np.concatenate([p - self.low, self.high - p])
            face = int(np.argmin(depths))
            out[face % 3] += (-1 if face < 3 else 1) * depths[face] * self.stiffness
        return out

    def step(self):
        now = time.monotonic()
        left, self.last = min(now - self.last, 0.05), now
        while left > 0:
            dt = min(left, 0.001)
            left -= dt
            if self.push is not None:
                axes, wanted, limit = self.push
                speed = np.clip(2e-4 * (axes @ wanted + self.force()), -limit, limit)
                self.position = self.position + dt * speed
            elif self.goal is not None:
                way = self.goal - self.position
                length = np.linalg.norm(way)
                if length <= self.speed * dt:
                    self.position, self.goal = self.goal.copy(), None
                else:
                    self.position = self.position + self.speed * dt / length * way


class RTDEReceiveInterface:
    def __init__(self, world):
        self.world = world

    def getActualTCPPose(self):
        self.world.step()
        return list(self.world.position) + list(self.world.turn)

    def getActualTCPForce(self):
        self.world.step()
        noise = self.world.noise * self.world.random.standard_normal(3) if self.world.noise else 0.0
        return list(self.world.force() + self.world.offset + noise) + [0.0, 0.0, 0.0]

    def getActualQ(self):
        # Of a gantry that has no turning joints: the double's point moves without an arm.
        return [0.0] * 6

    def getTimestamp(self):
        return time.monotonic() - self.world.begin

    def isProtectiveStopped(self):
        return self.world.protective


class RTDEControlInterface:
    def __init__(self, world):
        self.world = world

    def moveL(self, pose, speed=0.25, acceleration=1.2, asynchronous=False):
        self.world.step()
        self.world.goal, self.world.speed = np.array(pose[:3]), speed
        self.world.moves += 1
        return True

    def getAsyncOperationProgress(self):
        self.world.step()
        return -1 if self.world.goal is None else 0

    def stopL(self, deceleration=10.0):
        self.world.step()
        self.world.goal = None

    def forceMode(self, frame, selection, wrench, kind, limits):
        from ur_rtde_bridge import rotation
        self.world.step()
        self.world.push = (rotation(frame[3:]), np.array(wrench[:3], float), np.array(limits[:3], float).max())
        return True

    def forceModeStop(self):
        self.world.step()
        self.world.push = None
        return True

    def zeroFtSensor(self):
        self.world.step()
        self.world.offset = -self.world.force()
        return True

    def reuploadScript(self):
        return True
