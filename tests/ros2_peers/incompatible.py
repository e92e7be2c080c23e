"""Publishes a latched topic as volatile, which its subscribers cannot take: incompatible.py NODE TOPIC TYPE

Answers with the status "topics" of the node once it is not OK.
"""

import sys

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from peer import answer, message_type, plain, reliable, spin_until

target, topic, type_name = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("volatile_publisher")
publisher = node.create_publisher(message_type(type_name), topic, reliable(10))
found = []


def take(array):
    found.extend(
        plain(status)
        for status in array.status
        if status.name == f"{target}: topics" and status.level != b"\x00"
    )


node.create_subscription(DiagnosticArray, "/diagnostics", take, reliable(10))
spin_until(node, lambda: found, f"a bad status of {target}")
answer(found[0])
rclpy.shutdown()
