"""Asks for transitions of a lifecycle node: change_state.py NODE [TRANSITION ...]

Answers with success and state after each; without a transition with the state alone.
"""

import sys

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from peer import answer, spin_until

target, *transitions = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("manager")


def ask(kind, name, request):
    client = node.create_client(kind, f"{target}/{name}")
    if not client.wait_for_service(timeout_sec=20.0):
        sys.exit(f"{target} has no service {name}")
    call = client.call_async(request)
    spin_until(node, call.done, f"an answer of {target}/{name}", 20.0)
    return call.result()


def state():
    return ask(GetState, "get_state", GetState.Request()).current_state.label


answers = []
for transition in transitions:
    request = ChangeState.Request(transition=Transition(id=int(transition)))
    success = ask(ChangeState, "change_state", request).success
    answers.append({"success": success, "state": state()})
answer(answers or [{"success": True, "state": state()}])
rclpy.shutdown()
