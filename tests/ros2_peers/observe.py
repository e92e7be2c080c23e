"""Reads topics: observe.py NAME TYPE COUNT [NAME TYPE COUNT ...] [-- NAME ...]

Waits for COUNT messages of each, and until the graph shows the nodes and topics behind `--`; answers with the first and the last of them and with the graph as rclpy sees it.
A COUNT that ends in `L` asks for the latched messages, transient local; one that ends in `B` for best effort.
"""

import sys

import rclpy
from peer import answer, best_effort, message_type, plain, reliable, spin_until

rclpy.init()
node = rclpy.create_node("observer")
wanted = {}
received = {}
arguments = sys.argv[1:]
expected = []
if "--" in arguments:
    at = arguments.index("--")
    arguments, expected = arguments[:at], arguments[at + 1 :]
for name, type_name, count in zip(arguments[0::3], arguments[1::3], arguments[2::3]):
    wanted[name] = int(count.rstrip("LB"))
    received[name] = []
    qos = best_effort() if count.endswith("B") else reliable(latched=count.endswith("L"))
    node.create_subscription(message_type(type_name), name, received[name].append, qos)
spin_until(
    node,
    lambda: all(len(received[name]) >= count for name, count in wanted.items()),
    f"{wanted} messages",
)


def nodes():
    return sorted(f"{space.rstrip('/')}/{name}" for name, space in node.get_node_names_and_namespaces())


def missing():
    """What the graph does not show yet. It learns of endpoints, of nodes, and which is whose, each by itself."""
    there = {*nodes(), *dict(node.get_topic_names_and_types())}
    publishers = [info.node_name for name in wanted for info in node.get_publishers_info_by_topic(name)]
    return set(expected) - there or {name for name in publishers if "UNKNOWN" in name}


spin_until(node, lambda: not missing(), f"{expected} and whose publishers are in the graph")
answer(
    {
        "nodes": nodes(),
        "topics": dict(node.get_topic_names_and_types()),
        "services": dict(node.get_service_names_and_types()),
        "publishers": {
            name: [
                {
                    "node": info.node_name,
                    "type": info.topic_type,
                    "reliability": info.qos_profile.reliability.name,
                    "durability": info.qos_profile.durability.name,
                }
                for info in node.get_publishers_info_by_topic(name)
            ]
            for name in wanted
        },
        "first": {name: plain(messages[0]) for name, messages in received.items()},
        "last": {name: plain(messages[-1]) for name, messages in received.items()},
    }
)
rclpy.shutdown()
