#!/usr/bin/env python3
"""Laws of the Python bridges, over loopback, against doubles of ur_rtde and rclpy: a guarded motion ends at the block;
nothing moves before the start, after a wrong token, version, unit or number, after garbage, or when the link is silent;
a stop and a lost link end a motion under way; a driver that raises is a fault, and the next session is served; a second
client is told busy at once; what both ends send is what the schema says."""
import json
import os
import socket
import sys
import threading
import time
import unittest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path[:0] = [os.path.join(ROOT, "integrations", "python"), os.path.join(ROOT, "integrations", "ros2"),
                os.path.join(ROOT, "integrations", "ur", "double")]
import fake_ros  # noqa: E402
import fake_rtde  # noqa: E402
import feeler_robot  # noqa: E402
import feeler_ros2  # noqa: E402
import ur_rtde_bridge  # noqa: E402
import urscript  # noqa: E402

feeler_robot.LINK_TIMEOUT_S = 2.0  # a loaded machine is not a lost link; the test of silence waits for it
IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
VALIDATE = feeler_robot.schema_validator()


class Client:
    def __init__(self, port, token="", version=1, units=feeler_robot.UNITS):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.file = self.socket.makefile("r")
        self.seq = -1
        self.welcome = self.ask("hello", version=version, units=units, client="test", token=token)

    def send(self, kind, seq=None, **fields):
        if kind != "heartbeat":
            self.seq = self.seq + 1 if seq is None else seq
        message = dict(type=kind, seq=0 if kind == "heartbeat" else self.seq, **fields)
        self.socket.sendall(json.dumps(message).encode() + b"\n")

    def read(self, silent=False):
        """The next reply that is no heartbeat; sends heartbeats meanwhile."""
        while True:
            line = self.file.readline()
            if not line:
                return None
            reply = json.loads(line)
            VALIDATE("reply_" + reply["type"], reply)
            if reply["seq"] == 0 and reply["type"] == "state":
                if not silent:
                    self.send("heartbeat")
                continue
            return reply

    def ask(self, kind, seq=None, **fields):
        try:
            self.send(kind, seq, **fields)
            return self.read()
        except OSError:
            return None

    def down(self, distance=0.25, speed=0.2):
        return dict(direction=[0, 0, -1], distance_m=distance, speed_m_s=speed, contact_force_n=6.0)


class Bridges:
    """Laws for any driver; `make` gives (driver, world, things to stop)."""

    def setUp(self):
        self.world = fake_rtde.World(start=(0.5, 0.0, 0.2))
        self.driver = self.make(self.world)
        self.server = feeler_robot.Server(self.driver, "secret")
        self.listener = feeler_robot.listen("127.0.0.1", 0, "secret")
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        try:
            self.server.serve(self.listener)
        except OSError:
            pass

    def tearDown(self):
        self.listener.close()

    def client(self):
        """A session of its own, as soon as the one before is over."""
        end = time.monotonic() + 5.0
        client = Client(self.port, "secret")
        while client.welcome.get("code") == "busy" and time.monotonic() < end:
            client = Client(self.port, "secret")
        self.assertEqual(client.welcome["type"], "welcome")
        return client

    def test_touches_the_block(self):
        client = self.client()
        client.ask("start")
        self.assertEqual(client.ask("zero")["type"], "state")
        result = client.ask("guarded", **client.down())
        self.assertEqual((result["reason"], result["contact"]), ("contact", True))
        self.assertLess(result["pose"][11], 0.1)
        self.assertGreater(result["pose"][11], 0.0)  # how far beyond is a question of the machine
        up = client.ask("linear", pose=[1, 0, 0, 0.5, 0, 1, 0, 0.0, 0, 0, 1, 0.104], speed_m_s=0.2, contact_force_n=6.0)
        self.assertEqual(up["reason"], "reached", up)
        pressed = client.ask("compliant", poses=[[1, 0, 0, 0.5, 0, 1, 0, 0.0, 0, 0, 1, 0.05]], speed_m_s=0.2,
                             force_limit_n=40.0, time_limit_s=20.0, stiffness_n_m=[1000, 1000, 4000],
                             rotational_stiffness_nm_rad=200.0)
        self.assertIn(pressed["reason"], ("contact", "force_limit"))
        self.assertLess(pressed["peak_force_n"], 60.0)  # how hard it presses is a question of the machine's speed
        client.send("bye")

    def test_nothing_moves_before_the_start_or_outside_of_the_limits(self):
        client = self.client()
        self.assertEqual(client.ask("guarded", **client.down())["code"], "refused")
        client.ask("start")
        self.assertEqual(client.ask("guarded", **client.down(speed=9.0))["code"], "refused")
        self.assertEqual(client.ask("guarded", **client.down(distance=9.0))["code"], "refused")
        self.assertEqual(client.ask("guarded", **{**client.down(), "contact_force_n": 1e9})["code"], "refused")
        stiff = dict(poses=[IDENTITY], speed_m_s=0.2, force_limit_n=40.0, time_limit_s=20.0)
        for stiffness, rotational in (([1000, 1000, 1e6], 200.0), ([1000, 1000, 4000], 1e6)):
            refused = client.ask("compliant", stiffness_n_m=stiffness, rotational_stiffness_nm_rad=rotational, **stiff)
            self.assertEqual(refused["code"], "refused")
        self.assertEqual(self.server.motions, 0)

    def test_wrong_token_version_and_units_are_told(self):
        self.assertEqual(Client(self.port, "wrong").welcome["code"], "token")
        self.assertEqual(Client(self.port, "secret", version=2).welcome["code"], "version")
        self.assertEqual(Client(self.port, "secret", units="mm").welcome["code"], "units")

    def test_what_is_not_sound_ends_the_session(self):
        for bad in (b'{"type":"guarded"\n', b"(7,1)\n", b'{"type":"state","seq":1,"seq":2}\n', b"\xff\xfe\n",
                    b'{"type":"guarded","seq":2,"direction":[0,0,NaN],"distance_m":1,"speed_m_s":1,"contact_force_n":1}\n',
                    b"[" * 5000 + b"\n"):
            client = self.client()
            client.ask("start")
            client.socket.sendall(bad)
            reply = client.read()
            self.assertEqual(reply["code"], "malformed", bad[:40])
            self.assertIsNone(client.ask("guarded", **client.down()))
        client = self.client()
        client.ask("start")
        self.assertEqual(client.ask("guarded", seq=5, **client.down())["code"], "sequence")
        for line in (b'{"type":"heartbeat","seq":77}\n', json.dumps(dict(
                type="hello", seq=2, version=1, units=feeler_robot.UNITS, client="test", token="secret")).encode() + b"\n"):
            client = self.client()
            client.ask("start")
            client.socket.sendall(line)
            self.assertEqual(client.read()["code"], "sequence", line)
            self.assertIsNone(client.ask("guarded", **client.down()))
        self.assertEqual(self.server.motions, 0)

    def test_a_stop_and_a_lost_link_end_a_motion(self):
        client = self.client()
        client.ask("start")
        client.send("linear", pose=[1, 0, 0, -1.0, 0, 1, 0, 0.0, 0, 0, 1, 0.2], speed_m_s=0.05, contact_force_n=6.0)
        time.sleep(0.1)
        client.send("stop")
        self.assertEqual(client.read()["detail"], "stopped by order")
        self.assertEqual(client.read()["type"], "state")
        client.send("linear", pose=[1, 0, 0, -1.0, 0, 1, 0, 0.0, 0, 0, 1, 0.2], speed_m_s=0.05, contact_force_n=6.0)
        time.sleep(0.1)
        client.socket.shutdown(socket.SHUT_RDWR)
        self.client()  # served as soon as the lost session is over: the robot is at rest
        time.sleep(0.15)
        before = self.driver.pose()[0, 3]
        time.sleep(0.1)
        self.assertEqual(self.driver.pose()[0, 3], before)
        self.assertGreater(before, 0.0)

    def test_a_driver_that_raises_is_a_fault_and_the_next_session_is_served(self):
        wrench, calls = self.driver.wrench, []

        def lost_after_a_while():
            calls.append(1)
            if len(calls) > 20:
                raise RuntimeError("the driver is gone")
            return wrench()

        client = self.client()
        client.ask("start")
        self.driver.wrench = lost_after_a_while
        client.send("linear", pose=[1, 0, 0, -1.0, 0, 1, 0, 0.0, 0, 0, 1, 0.2], speed_m_s=0.05, contact_force_n=6.0)
        told = client.read()
        self.assertEqual((told["type"], told["code"]), ("error", "fault"), told)
        self.assertIn("the driver is gone", told["text"])
        self.driver.wrench = wrench
        time.sleep(0.15)
        before = self.driver.pose()[0, 3]
        time.sleep(0.1)
        self.assertEqual(self.driver.pose()[0, 3], before)
        client = self.client()
        self.assertEqual(client.ask("guarded", **client.down())["code"], "refused")
        client.ask("start")
        self.assertEqual(client.ask("guarded", **client.down(distance=0.01))["type"], "result")

    def test_a_second_client_is_told_busy_at_once(self):
        client = self.client()
        client.ask("start")
        client.send("linear", pose=[1, 0, 0, 0.4, 0, 1, 0, 0.0, 0, 0, 1, 0.2], speed_m_s=0.1, contact_force_n=6.0)
        began = time.monotonic()
        self.assertEqual(Client(self.port, "secret").welcome["code"], "busy")
        self.assertLess(time.monotonic() - began, 0.8)
        self.assertEqual(client.read()["type"], "result")
        self.assertEqual(client.ask("state")["type"], "state")

    def test_a_protective_stop_asks_for_recovery(self):
        client = self.client()
        client.ask("start")
        self.world.protective = True
        time.sleep(0.05)
        self.assertEqual(client.ask("guarded", **client.down())["code"], "refused")
        self.assertEqual(client.ask("recover")["code"], "refused")  # and the session goes on
        self.world.protective = False
        time.sleep(0.05)
        self.assertEqual(client.ask("guarded", **client.down())["code"], "refused")
        client.ask("recover")
        self.assertEqual(client.ask("guarded", **client.down())["reason"], "contact")


class UrRtde(Bridges, unittest.TestCase):
    def make(self, world):
        return ur_rtde_bridge.UrDriver(fake_rtde.RTDEControlInterface(world), fake_rtde.RTDEReceiveInterface(world))


class Ros2(Bridges, unittest.TestCase):
    def make(self, world):
        node = fake_ros.FakeNode(world)
        driver = feeler_ros2.RosDriver(node, fake_ros.MESSAGES)
        self.stopping = threading.Event()
        threading.Thread(target=node.spin, args=(self.stopping,), daemon=True).start()
        while not driver.ready():
            time.sleep(0.01)
        return driver

    def tearDown(self):
        super().tearDown()
        self.stopping.set()


class Script(unittest.TestCase):
    def run_script(self, text, steps=100):
        said = []
        interpreter = urscript.Interpreter(text, {"say": said.append, "sync": lambda: (i for i in [None])})
        for _, _ in zip(interpreter.steps(), range(steps)):
            pass
        return said

    def test_values_scopes_and_branches(self):
        self.assertEqual(self.run_script('''
def program():
  global total = 0
  def add(x, y):   # nested, and a comment
    total = total + x * y - 1
    return [x, p[1, 2, 3, 0, 0, 0]]
  end
  i = 0
  while i < 3:
    got = add(i, 2)
    i = i + 1
  end
  copy = got
  copy[0] = 9
  if total == 3 and not (i != 3):
    say(total)
  elif True:
    say("wrong")
  else:
    say("worse")
  end
  say(got[0] + got[1][2])
  say(-2 * (1 + 0.5))
end
program()
'''), [3, 5, -3.0])

    def test_threads_advance_together_and_can_be_killed(self):
        self.assertEqual(self.run_script('''
def program():
  global count = 0
  thread counter():
    while True:
      count = count + 1
      sync()
    end
  end
  t = run counter()
  sync()
  sync()
  sync()
  kill t
  before = count
  sync()
  sync()
  say(before)
  say(count - before)
end
program()
'''), [2, 0])  # a thread has its first turn a step later

    def test_what_it_does_not_know_is_refused(self):
        for bad in ("def f():\n", "end\n", "x = \n", "f(1\n", "if True:\n", "x = $\n", "g()\n"):
            with self.assertRaises((urscript.ScriptError, IndexError)):
                self.run_script(bad)

    def test_the_uploaded_text_parses(self):
        with open(os.path.join(ROOT, "integrations", "ur", "feeler_robot.script")) as script:
            self.assertEqual(len(urscript.parse(script.read())), 2)


if __name__ == "__main__":
    unittest.main()
