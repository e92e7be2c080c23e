"""Ends two processes and watches the graph: leaving.py PID NODE TOPIC KILLED_PID KILLED_NODE

The one is asked to end, the other is killed. Answers, when neither the first node nor a publisher of its topic is there
any more, with whether the killed one is: nobody knows of its end before its lease runs out.
"""

import os
import signal
import sys

import rclpy
from peer import answer, spin_until

process, name, topic, killed_process, killed = int(sys.argv[1]), sys.argv[2], sys.argv[3], int(sys.argv[4]), sys.argv[5]
rclpy.init()
node = rclpy.create_node("watcher")


def there():
    return name in node.get_node_names(), node.count_publishers(topic)


def killed_is_there():
    return killed in node.get_node_names()


spin_until(node, lambda: there() == (True, 1) and killed_is_there(), f"{name}, {topic} and {killed}")
os.kill(killed_process, signal.SIGKILL)
os.kill(process, signal.SIGINT)
spin_until(node, lambda: there() == (False, 0), f"{name} and {topic} gone")
answer({"killed_is_there": killed_is_there()})
rclpy.shutdown()
