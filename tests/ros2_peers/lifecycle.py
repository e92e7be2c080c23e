"""Manages a node as a lifecycle manager does: lifecycle.py NODE TOPIC TYPE

Takes it through every step, counts the messages of TOPIC in every state, collects its transition events, and answers with
its states and transitions beside those of a lifecycle node of rclpy itself.
"""

import sys
import time

import rclpy
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from peer import answer, call, message_type, plain, reliable, spin_until
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode

target, topic, type_name = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("manager")
reference = LifecycleNode("reference")
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.add_node(reference)


def ask(owner, kind, name, request=None):
    return plain(call(node, kind, f"{owner}/{name}", request, lambda: executor.spin_once(timeout_sec=0.1)))


def state():
    return ask(target, GetState, "get_state")["current_state"]["label"]


def change(identifier, label=""):
    request = ChangeState.Request(transition=Transition(id=identifier, label=label))
    return ask(target, ChangeState, "change_state", request)["success"]


def spin(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)


def wait(condition, what):
    spin_until(node, condition, what, lambda: executor.spin_once(timeout_sec=0.05))


received = []
events = []
node.create_subscription(message_type(type_name), topic, received.append, reliable())
node.create_subscription(
    TransitionEvent,
    f"{target}/transition_event",
    lambda event: events.append(f"{event.start_state.label} {event.transition.label} {event.goal_state.label}"),
    reliable(10),
)


def stand(name, speaks=False, publishers=None):
    """What holds in this state; messages on their way when it began are not counted. What speaks is waited for."""
    if publishers is not None:
        wait(lambda: node.count_publishers(topic) == publishers, f"{name}: {publishers} publishers")
    spin(1.0)
    before = len(received)
    if speaks:
        wait(lambda: len(received) > before + 25, f"{name}: messages")
    else:
        spin(1.0)
    return {
        "asked": name,
        "state": state(),
        "messages": len(received) - before,
        "publishers": node.count_publishers(topic),
    }


def graph(owner):
    return {
        "states": ask(owner, GetAvailableStates, "get_available_states"),
        "graph": ask(owner, GetAvailableTransitions, "get_transition_graph"),
        "from_here": ask(owner, GetAvailableTransitions, "get_available_transitions"),
    }


begin = stand("nothing")
refused = change(Transition.TRANSITION_ACTIVATE)
graphs = {"ours": graph(target), "reference": graph("reference")}
steps = [begin]
for identifier, label, speaks, publishers in [
    (Transition.TRANSITION_CONFIGURE, "", False, 1),
    (Transition.TRANSITION_ACTIVATE, "", True, 1),
    (Transition.TRANSITION_DEACTIVATE, "", False, None),
    (Transition.TRANSITION_CLEANUP, "", False, None),
    (0, "configure", False, None),
    (0, "activate", True, None),
    (0, "shutdown", False, None),
]:
    if not change(identifier, label):
        sys.exit(f"transition {identifier} '{label}' failed from {state()}")
    steps.append(stand(label or str(identifier), speaks, publishers))
# Two of each transition.
wait(lambda: len(events) >= 2 * (len(steps) - 1), "all events")
answer({"refused": refused, "graphs": graphs, "steps": steps, "events": events})
rclpy.shutdown()
