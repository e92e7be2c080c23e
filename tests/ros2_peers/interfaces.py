"""Exchanges messages, requests and goals, all filled, with the test: interfaces.py TYPE [TYPE ...]

Messages go over /to_rust/TYPE and /to_python/TYPE, requests over /rust/NAME and /python/NAME, and so do goals. Answers
with what was sent and what was received, by type, and with the hashes that rosidl gave the types.
"""

import json
import os
import pathlib
import sys

import rclpy
from control_msgs.action import FollowJointTrajectory
from peer import answer, filled, message_type, plain, reliable, spin_until
from rclpy.action import ActionClient, ActionServer
from rclpy.duration import Duration
from rotary_sins_msgs.action import SelfCalibrate
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

ACTIONS = {"follow": FollowJointTrajectory, "calibrate": SelfCalibrate}
SERVICES = {"set_bool": SetBool, "trigger": Trigger}

rclpy.init()
node = rclpy.create_node("interfaces")
sent, received, missing = {}, {}, []
publishers, messages = [], {}


def note(book, part, message):
    book[part] = plain(message)


# Messages.
for name in sys.argv[1:]:
    try:
        kind = message_type(name)
    except ModuleNotFoundError:
        missing.append(name)
        continue
    messages[name] = filled(kind)
    sent[name] = plain(messages[name])
    publishers.append((node.create_publisher(kind, f"/to_rust/{name}", reliable(1, latched=True)), messages[name]))
    node.create_subscription(
        kind, f"/to_python/{name}", lambda message, name=name: note(received, name, message), reliable(1, latched=True)
    )

# What Python serves.
for name, kind in SERVICES.items():

    def respond(request, _, name=name, kind=kind):
        note(received, f"{name} request", request)
        return filled(kind.Response)

    node.create_service(kind, f"/python/{name}", respond)
    sent[f"{name} response"] = plain(filled(kind.Response))
for name, kind in ACTIONS.items():

    def execute(goal, name=name, kind=kind):
        note(received, f"{name} goal", goal.request)
        goal.publish_feedback(filled(kind.Feedback))
        goal.succeed()
        return filled(kind.Result)

    ActionServer(node, kind, f"/python/{name}", execute)
    sent[f"{name} feedback"] = plain(filled(kind.Feedback))
    sent[f"{name} result"] = plain(filled(kind.Result))

finished = []
node.create_subscription(String, "/done", finished.append, reliable(1, latched=True))

spin_until(node, lambda: all(p.get_subscription_count() > 0 for p, _ in publishers), "everybody listens")
for publisher, message in publishers:
    publisher.publish(message)

# What Rust serves.
for name, kind in SERVICES.items():
    client = node.create_client(kind, f"/rust/{name}")
    spin_until(node, client.service_is_ready, f"service {name}")
    request = filled(kind.Request)
    sent[f"{name} request"] = plain(request)
    call = client.call_async(request)
    spin_until(node, call.done, f"response of {name}")
    note(received, f"{name} response", call.result())
for name, kind in ACTIONS.items():
    client = ActionClient(node, kind, f"/rust/{name}")
    spin_until(node, client.server_is_ready, f"action {name}")
    goal = filled(kind.Goal)
    sent[f"{name} goal"] = plain(goal)
    call = client.send_goal_async(
        goal, lambda message, name=name: note(received, f"{name} feedback", message.feedback)
    )
    spin_until(node, call.done, f"an answer of {name}")
    spin_until(node, lambda: f"{name} feedback" in received, f"feedback of {name}")
    # rclpy drops a feedback that comes after the result.
    result = call.result().get_result_async()
    spin_until(node, result.done, f"result of {name}")
    note(received, f"{name} result", result.result().result)

expected = set(messages) | {f"{name} {part}" for name in SERVICES for part in ("request", "response")}
expected |= {f"{name} {part}" for name in ACTIONS for part in ("goal", "feedback", "result")}
spin_until(node, lambda: expected <= set(received), "everything")
spin_until(node, lambda: finished, "the test has heard everything")
for publisher, _ in publishers:
    if not publisher.wait_for_all_acked(Duration(seconds=20)):
        sys.exit(f"{publisher.topic_name}: not acknowledged")

hashes = {}
share = pathlib.Path(os.environ.get("AMENT_PREFIX_PATH", sys.prefix).split(":")[0]) / "share"
for file in share.glob("*/*/*.json"):
    described = json.loads(file.read_text())
    for entry in described.get("type_hashes", []):
        hashes[entry["type_name"]] = entry["hash_string"]
answer({"sent": sent, "received": received, "missing": missing, "hashes": hashes})
rclpy.shutdown()
