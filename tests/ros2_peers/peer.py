"""What the peers share: messages as plain values, QoS of the suite's topics, JSON on standard output."""

import importlib
import itertools
import json
import re
import sys
import time

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def plain(value):
    """A message, or a part of one, as what JSON can hold."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):  # of type octet
        return value[0]
    if hasattr(value, "dtype") and not value.shape:
        return value.item()
    if isinstance(value, (str, bool, int, float)):
        return value
    return [plain(element) for element in value]


def filled(kind, count=None):
    """An instance of a message class in which no field has its default and neighbours differ."""
    count = count or itertools.cycle(range(1, 121))
    message = kind()
    for name, field in kind.get_fields_and_field_types().items():
        setattr(message, name, made_up(field, count))
    return message


def made_up(field, count):
    """A value for a field of this type, as rosidl names it."""
    if array := re.fullmatch(r"(.+)\[(\d+)\]", field):
        return [made_up(array[1], count) for _ in range(int(array[2]))]
    if sequence := re.fullmatch(r"sequence<(.+?)(, \d+)?>", field):
        return [made_up(sequence[1], count) for _ in range(2)]
    if "/" in field:
        package, name = field.split("/")
        return filled(message_type(f"{package}/msg/{name}"), count)
    if field == "boolean":
        return True
    if field == "octet":
        return bytes([next(count)])
    if field in ("float", "double"):
        return next(count) + 0.25
    if field.startswith("string"):
        return f"text {next(count)}"
    return next(count)


def message_type(name):
    """Class of `package/msg/Name`."""
    package, kind, name = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), name)


def reliable(depth=1000, latched=False):
    """Reliable, and transient local where it is latched."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE, durability=durability)


def best_effort(depth=100):
    """What /clock is offered with."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


# Longest time that anything is waited for, as GUARD of the tests: it only ends what would never end.
GUARD = 600.0


def spin_until(node, condition, what, spin=None):
    """Spins until the condition holds; ends the program with a line where it never does."""
    spin = spin or (lambda: rclpy.spin_once(node, timeout_sec=0.1))
    end = time.monotonic() + GUARD
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"not after {GUARD:.0f} s: {what}")
        spin()


def call(node, kind, name, request=None, spin=None):
    """The answer of a service; `spin` spins for a while where more than this node has to."""
    client = node.create_client(kind, name)
    if not client.wait_for_service(timeout_sec=GUARD):
        sys.exit(f"no service {name}")
    future = client.call_async(request or kind.Request())
    spin_until(node, future.done, f"an answer of {name}", spin)
    return future.result()


def watch_joints(node, names=("outer_joint", "inner_joint")):
    """The newest position and velocity of the table's joints; empty before the first."""
    newest = {}

    def take(message):
        order = [message.name.index(name) for name in names]
        newest["position"] = [message.position[i] for i in order]
        newest["velocity"] = [message.velocity[i] for i in order]

    node.create_subscription(JointState, "/turntable/joint_states", take, reliable())
    return newest


def trajectory(start, target, seconds, names=("outer_joint", "inner_joint")):
    """A motion from rest to rest, by a cubic."""
    motion = JointTrajectory(joint_names=list(names))
    for at, position in [(0, start), (seconds, target)]:
        point = JointTrajectoryPoint(positions=position, velocities=[0.0, 0.0])
        point.time_from_start.sec = at
        motion.points.append(point)
    return motion


def answer(value):
    """Prints the one JSON that this program answers with."""
    print(json.dumps(value))
