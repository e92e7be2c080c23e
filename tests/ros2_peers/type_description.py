"""Asks a node for the description of types: type_description.py NODE TYPE [TYPE ...]

Answers for each with what the node says and with what rclpy says of the same type; the hash that is asked for is rclpy's.
"""

import sys

import rclpy
from peer import answer, call, message_type, plain, spin_until
from rclpy.executors import SingleThreadedExecutor
from type_description_interfaces.srv import GetTypeDescription

target, *types = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("asker")
reference = rclpy.create_node("reference")
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.add_node(reference)
publishers = [reference.create_publisher(message_type(name), f"/reference/type{index}", 1) for index, name in enumerate(types)]


def hash_of(topic):
    """As the graph shows it, of rclpy's own publisher."""
    found = []

    def look():
        found[:] = [info.topic_type_hash for info in node.get_publishers_info_by_topic(topic)]
        return bool(found)

    spin_until(node, look, f"{topic} in the graph")
    value = found[0]
    return f"RIHS{value.version:02}_{bytes(value.value).hex()}"


def ask(owner, name, type_hash):
    request = GetTypeDescription.Request(type_name=name, type_hash=type_hash, include_type_sources=True)
    service = f"{owner}/get_type_description"
    return plain(call(node, GetTypeDescription, service, request, lambda: executor.spin_once(timeout_sec=0.1)))


answers = {}
for index, name in enumerate(types):
    type_hash = hash_of(f"/reference/type{index}")
    answers[name] = {"ours": ask(target, name, type_hash), "reference": ask("reference", name, type_hash)}
answers["unknown"] = ask(target, "sensor_msgs/msg/PointCloud2", "RIHS01_" + "0" * 64)
answer(answers)
rclpy.shutdown()
