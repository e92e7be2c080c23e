"""Gives a node the time: sim_time.py NODE

Publishes /clock, sets use_sim_time on and off again, and answers with the stamps of its diagnostics in all three states.
"""

import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from peer import GUARD, answer, best_effort, reliable, spin_until
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rosgraph_msgs.msg import Clock

target = sys.argv[1]
SIMULATED = 1234
rclpy.init()
node = rclpy.create_node("clock")
clock = node.create_publisher(Clock, "/clock", best_effort(1))


def tick():
    message = Clock()
    message.clock.sec = SIMULATED
    clock.publish(message)


node.create_timer(0.05, tick)
stamps = []


def take(array):
    if any(status.name.startswith(target) for status in array.status):
        stamps.append(array.header.stamp.sec)


node.create_subscription(DiagnosticArray, "/diagnostics", take, reliable(10))
client = AsyncParameterClient(node, target)
if not client.wait_for_services(timeout_sec=GUARD):
    sys.exit(f"{target} has no parameter services")


def simulate(value):
    future = client.set_parameters([Parameter("use_sim_time", value=value)])
    spin_until(node, future.done, "an answer")
    result = future.result().results[0]
    if not result.successful:
        sys.exit(result.reason)


def is_simulated(value):
    """Whether stamps come to be of that clock."""
    spin_until(
        node,
        lambda: stamps and (stamps[-1] == SIMULATED) == value,
        f"stamps with use_sim_time {value}, but {stamps[-3:]}",
    )


is_simulated(False)
simulate(True)
is_simulated(True)
simulate(False)
is_simulated(False)
answer({"error_of_the_last_s": abs(stamps[-1] - time.time())})
rclpy.shutdown()
