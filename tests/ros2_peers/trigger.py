"""Calls services of type std_srvs/srv/Trigger, one after the other: trigger.py SERVICE [SERVICE ...]"""

import sys

import rclpy
from peer import answer, spin_until
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("caller")
answers = []
for name in sys.argv[1:]:
    client = node.create_client(Trigger, name)
    if not client.wait_for_service(timeout_sec=15.0):
        sys.exit(f"no service {name}")
    call = client.call_async(Trigger.Request())
    spin_until(node, call.done, f"an answer of {name}", 20.0)
    answers.append({"success": call.result().success, "message": call.result().message})
answer(answers)
rclpy.shutdown()
