"""Asks for transitions of a lifecycle node: change_state.py NODE [TRANSITION ...]

Answers with success and state after each; without a transition with the state alone.
"""

import sys

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from peer import answer, call

target, *transitions = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("manager")


def state():
    return call(node, GetState, f"{target}/get_state").current_state.label


answers = []
for transition in transitions:
    request = ChangeState.Request(transition=Transition(id=int(transition)))
    success = call(node, ChangeState, f"{target}/change_state", request).success
    answers.append({"success": success, "state": state()})
answer(answers or [{"success": True, "state": state()}])
rclpy.shutdown()
