"""The robot's end of feeler's wire protocol (docs/robot-protocol.md, JSON form) for drivers in Python.

A driver has these members; poses are 4x4 numpy arrays base_T_tool, SI units:

  name, capabilities          a text, and a dict as in the protocol's `capabilities`
  pose(), wrench(), time()    now; wrench: six numbers, of the world on the tool, base axes
  joints()                    optional: joint positions, rad, from the base outwards, or None
  zero()                      the present wrench is zero
  protective_stopped()        whether the robot stopped by itself
  recover()                   after a person has looked
  transfer(goal)              } generators: each yields at least every 10 ms while the robot moves, and returns
  linear(goal, speed, force)  } (reason, contact, peak_force, pose, detail); closed early they bring the robot to
  guarded(direction, distance, speed, force)                                     } rest (a finally clause)
  compliant(poses, speed, force, time, stiffness, rotational_stiffness)          }

Nothing moves before hello and start, nor after a frame that is not sound, a number out of sequence or a silent link; a
motion under way is brought to rest. A driver that raises is answered as `fault`, with the robot at rest: nothing moves
in that session any more. `serve` handles one session after the other; who knocks meanwhile is told `busy`.
"""
import hmac
import json
import os
import queue
import select
import socket
import sys
import threading
import time

import numpy as np

VERSION, UNITS = 1, "m kg s rad N"
BEAT_S, LINK_TIMEOUT_S, MOST_BYTES = 0.02, 0.1, 1 << 18
# As execution/remote/robot_server.h: what no robot is asked for, and from where on a straight way is not watched.
MOST_STIFFNESS, MOST_ROTATIONAL_STIFFNESS, NOT_WATCHED_N = 1e5, 1e4, 1e5
MOTIONS = ("transfer", "linear", "guarded", "compliant")


def rows(pose):
    return [float(v) for v in np.asarray(pose)[:3, :].reshape(-1)]


def matrix(numbers):
    pose = np.eye(4)
    pose[:3, :] = np.array(numbers, float).reshape(3, 4)
    r = pose[:3, :3]
    if np.abs(r.T @ r - np.eye(3)).max() > 1e-4 or np.linalg.det(r) < 0:
        raise ValueError("the rotation of a pose is no rotation")
    return pose


def schema_validator(path=None):
    """Checks messages against the protocol's JSON Schema; needs the package jsonschema."""
    import jsonschema

    here = os.path.dirname(os.path.abspath(__file__))
    with open(path or os.path.join(here, "..", "..", "execution", "remote", "protocol", "protocol.schema.json")) as f:
        schema = json.load(f)
    known = {}

    def validate(name, message):
        if name not in schema["$defs"]:
            raise ValueError("no message of that type")
        if name not in known:
            known[name] = jsonschema.Draft202012Validator({"$ref": "#/$defs/" + name, "$defs": schema["$defs"]})
        for error in known[name].iter_errors(message):
            raise ValueError(error.message[:200])

    return validate


def listen(host, port, token):
    if not (host.startswith("127.") or host in ("localhost", "::1")) and not token:
        raise SystemExit("others than this machine reach " + host + ", and no token is asked for: give --token-file")
    return socket.create_server((host, port))


class SessionOver(Exception):
    pass


class DriverFault(Exception):
    """What a driver raised, so that it is told from a frame that is not sound."""


class Guarded:
    """A driver whose exceptions are faults of the robot; those of a generator, too."""

    def __init__(self, driver):
        self._driver = driver

    def __getattr__(self, name):
        member = getattr(self._driver, name)
        if not callable(member):
            return member

        def call(*arguments):
            try:
                result = member(*arguments)
            except Exception as error:
                raise DriverFault(f"{name}: {type(error).__name__}: {error}") from error
            return self._motion(name, result) if name in MOTIONS else result

        return call

    @staticmethod
    def _motion(name, motion):
        try:
            return (yield from motion)
        except GeneratorExit:
            raise
        except Exception as error:
            raise DriverFault(f"{name}: {type(error).__name__}: {error}") from error


class Server:
    """`validator(name, message)` raises ValueError where a message is not as `$defs/name` of the schema says."""

    def __init__(self, driver, token="", validator=None):
        self.driver, self.token, self.validator = Guarded(driver), token, validator or schema_validator()
        self.motions = 0
        self.free = threading.Lock()  # held during a session

    # ---- the wire
    def _send(self, message):
        try:
            self.connection.sendall(json.dumps(message, allow_nan=False).encode() + b"\n")
        except OSError as error:
            raise SessionOver(str(error)) from error
        except ValueError as error:
            raise DriverFault("tells a number that is not finite") from error

    def _receive(self, wait_s):
        """The next frame, or None."""
        end = time.monotonic() + wait_s
        while b"\n" not in self.buffer:
            if len(self.buffer) > MOST_BYTES:
                raise ValueError("a frame is too long")
            ready, _, _ = select.select([self.connection], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                return None
            try:
                got = self.connection.recv(65536)
            except OSError as error:
                raise SessionOver(str(error)) from error
            if not got:
                raise SessionOver("the other end is gone")
            self.buffer += got
        line, _, self.buffer = self.buffer.partition(b"\n")
        self.heard = time.monotonic()

        def once(pairs):
            if len({k for k, _ in pairs}) != len(pairs):
                raise ValueError("a key stands twice")
            return dict(pairs)

        def no_number(text):
            raise ValueError(text + " is no number")

        frame = json.loads(line.decode("utf-8"), object_pairs_hook=once, parse_constant=no_number)
        if not isinstance(frame, dict) or not isinstance(frame.get("type"), str):
            raise ValueError("is no message")
        self.validator("request_" + frame["type"], frame)
        return frame

    def _state(self):
        state = {"time_s": float(self.driver.time()), "pose": rows(self.driver.pose()),
                 "wrench": [float(v) for v in self.driver.wrench()], "mode": self.mode}
        joints = self.driver.joints() if hasattr(self.driver, "joints") else None
        if joints is not None:
            state["joints"] = [float(v) for v in joints]
        return state

    def _beat(self):
        now = time.monotonic()
        if now - self.told >= BEAT_S:
            self.told = now
            self._send({"type": "state", "seq": 0, "state": self._state()})
        if now - self.heard > LINK_TIMEOUT_S:
            raise SessionOver("silent for 0.1 s")

    def _error(self, seq, code, text):
        self._send({"type": "error", "seq": seq, "code": code, "text": text[:400]})

    # ---- sessions
    def serve(self, listener, sessions=None):
        """Sessions in the thread that calls; another one tells who knocks meanwhile that the robot is busy."""
        waiting = queue.SimpleQueue()

        def knock():
            while True:
                try:
                    connection, _ = listener.accept()
                except OSError as error:
                    return waiting.put(error)
                if self.free.acquire(timeout=0.05):  # a session may be about to end
                    waiting.put(connection)
                else:
                    self._turn_away(connection)

        threading.Thread(target=knock, daemon=True).start()
        while sessions is None or sessions > 0:
            connection = waiting.get()
            if isinstance(connection, OSError):
                raise connection
            try:
                self.session(connection)
            finally:
                self.free.release()
            if sessions is not None:
                sessions -= 1

    @staticmethod
    def _turn_away(connection):
        busy = {"type": "error", "seq": 0, "code": "busy", "text": "another session is under way"}
        try:
            connection.settimeout(0.1)
            connection.sendall(json.dumps(busy).encode() + b"\n")
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(65536):  # closing with bytes unread would lose the last words
                pass
        except OSError:
            pass
        connection.close()

    def session(self, connection):
        self.connection, self.buffer, self.mode, self.seq = connection, b"", "waiting", 0
        self.heard = self.told = time.monotonic()
        try:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self._greet():
                while self._serve_one():
                    pass
        except (SessionOver, OSError):
            pass
        except DriverFault as fault:
            self._last_words("fault", fault)
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            self._last_words("malformed", error)
        finally:
            connection.close()

    def _last_words(self, code, error):
        try:
            self._error(self.seq, code, str(error))
        except SessionOver:
            pass

    def _greet(self):
        frame = self._receive(2.0)
        if frame is None:
            return False
        if frame["type"] != "hello" or frame["seq"] != 0:
            self._error(frame["seq"], "sequence", "a session begins with hello, number 0")
        elif frame["version"] != VERSION:
            self._error(0, "version", f"this robot speaks version {VERSION}")
        elif frame["units"] != UNITS:
            self._error(0, "units", "this robot counts in " + UNITS)
        elif self.token and not hmac.compare_digest(frame["token"].encode(), self.token.encode()):
            self._error(0, "token", "a wrong token")
        else:
            self._send({"type": "welcome", "seq": 0, "version": VERSION, "units": UNITS, "robot": self.driver.name,
                        "simulated": False, "lockstep": False, "link_timeout_s": LINK_TIMEOUT_S,
                        "capabilities": self.driver.capabilities, "state": self._state()})
            return True
        return False

    def _serve_one(self):
        frame = self._receive(BEAT_S / 2)
        self._beat()
        if frame is None or (frame["type"] == "heartbeat" and frame["seq"] == 0):
            return True
        if frame["type"] in ("heartbeat", "hello"):
            self._error(frame["seq"], "sequence", "a heartbeat has the number 0, and a session one hello")
            return False
        if frame["seq"] != self.seq + 1:
            self._error(frame["seq"], "sequence", f"number {frame['seq']} where {self.seq + 1} is due")
            return False
        self.seq, kind = frame["seq"], frame["type"]
        if kind == "bye":
            return False
        if self.driver.protective_stopped():
            self.mode = "protective_stop"
        if kind in MOTIONS:
            return self._move(kind, frame)
        if kind == "start" and self.mode == "waiting":
            self.mode = "ready"
        elif kind == "recover" and self.mode == "protective_stop":
            try:
                self.driver.recover()
            except DriverFault as fault:
                self._error(self.seq, "refused", str(fault))
                return True
            self.mode = "ready"
        elif kind == "zero":
            self.driver.zero()
        elif kind == "contact":
            c = self.driver.capabilities
            self._send({"type": "contact", "seq": self.seq, "held_mass_kg": c["effective_mass_kg"],
                        "free_mass_kg": c["effective_mass_kg"], "stiffness_n_m": 6e4, "damping_ratio": 1.0,
                        "reaction_time_s": c["reaction_time_s"], "force_noise_n": c["force_noise_n"]})
            return True
        elif kind not in ("state", "stop", "start", "recover"):
            self._error(self.seq, "refused", "this robot does not know " + kind)
            return True
        self._send({"type": "state", "seq": self.seq, "state": self._state()})
        return True

    def _refusal(self, kind, frame):
        if self.mode == "waiting":
            return "the operator has not started the robot"
        if self.mode != "ready":
            return "a protective stop has not been recovered from"
        c = self.driver.capabilities
        if frame.get("speed_m_s", 0.0) > c["max_speed_m_s"] * (1 + 1e-9):
            return "outside of the limits of the robot: speed"
        force = frame.get("force_limit_n", frame.get("contact_force_n", 0.0))
        if force > c["max_force_n"] and not (kind == "linear" and force >= NOT_WATCHED_N):
            return "outside of the limits of the robot: force"
        if kind == "compliant" and (max(frame["stiffness_n_m"]) > MOST_STIFFNESS or
                                    frame["rotational_stiffness_nm_rad"] > MOST_ROTATIONAL_STIFFNESS):
            return "outside of the limits of the robot: stiffness"
        if kind == "guarded":
            places = [self.driver.pose()[:3, 3] + frame["distance_m"] * np.array(frame["direction"])]
        else:
            places = [matrix(p)[:3, 3] for p in (frame["poses"] if kind == "compliant" else [frame["pose"]])]
        for place in places:
            if (place < np.array(c["workspace_min_m"])).any() or (place > np.array(c["workspace_max_m"])).any():
                return "outside of the limits of the robot: workspace"
        return ""

    def _motion(self, kind, m):
        if kind == "transfer":
            return self.driver.transfer(matrix(m["pose"]))
        if kind == "linear":
            return self.driver.linear(matrix(m["pose"]), m["speed_m_s"], m["contact_force_n"])
        if kind == "guarded":
            direction = np.array(m["direction"], float)
            if abs(np.linalg.norm(direction) - 1) > 1e-3:
                raise ValueError("a direction is no unit vector")
            return self.driver.guarded(direction, m["distance_m"], m["speed_m_s"], m["contact_force_n"])
        return self.driver.compliant([matrix(p) for p in m["poses"]], m["speed_m_s"], m["force_limit_n"],
                                     m["time_limit_s"], m["stiffness_n_m"], m["rotational_stiffness_nm_rad"])

    def _move(self, kind, frame):
        refusal = self._refusal(kind, frame)
        if refusal:
            self._error(self.seq, "refused", refusal)
            return True
        begin = self.driver.pose()[:3, 3].copy()
        motion = self._motion(kind, frame)
        self.mode = "moving"
        self.motions += 1
        stop, result = None, None
        try:
            while result is None:
                try:
                    next(motion)
                except StopIteration as ended:
                    result = ended.value
                    break
                self._beat()
                other = self._receive(0.0)
                if self.driver.protective_stopped():
                    result = ("aborted", False, 0.0, None, "protective stop")
                elif other is not None and other["type"] == "stop":
                    stop, result = other, ("aborted", False, 0.0, None, "stopped by order")
                elif other is not None and other["type"] != "heartbeat":
                    raise ValueError("one request at a time")
        finally:
            motion.close()  # at rest, whatever ended it
            self.mode = "protective_stop" if self.driver.protective_stopped() else "ready"
        reason, contact, peak, pose, detail = result
        pose = self.driver.pose() if pose is None else pose
        self._send({"type": "result", "seq": self.seq, "reason": reason, "contact": bool(contact),
                    "travelled_m": float(np.linalg.norm(pose[:3, 3] - begin)), "peak_force_n": float(peak),
                    "pose": rows(pose), "detail": detail, "state": self._state()})
        if stop is not None:
            self.seq = stop["seq"]
            self._send({"type": "state", "seq": self.seq, "state": self._state()})
        return True
