"""What the peers share: messages as plain values, QoS of the suite's topics, JSON on standard output."""

import importlib
import json
import sys
import time

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def plain(value):
    """A message, or a part of one, as what JSON can hold."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (str, bool, int, float)):
        return value
    return [plain(element) for element in value]


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


def spin_until(node, condition, what, timeout=60.0):
    """Spins until the condition holds; ends the program with a line where it does not in time."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"not after {timeout:.0f} s: {what}")
        rclpy.spin_once(node, timeout_sec=0.1)


def answer(value):
    """Prints the one JSON that this program answers with."""
    print(json.dumps(value))
