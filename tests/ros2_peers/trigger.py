"""Calls services of type std_srvs/srv/Trigger, one after the other: trigger.py SERVICE [SERVICE ...]"""

import sys

import rclpy
from peer import answer, call
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("caller")
answers = []
for name in sys.argv[1:]:
    response = call(node, Trigger, name)
    answers.append({"success": response.success, "message": response.message})
answer(answers)
rclpy.shutdown()
