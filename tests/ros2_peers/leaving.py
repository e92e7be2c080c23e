"""Ends a process and watches the graph: leaving.py PID NODE TOPIC

Answers with the time from the signal until neither the node nor a publisher of the topic is there.
"""

import os
import signal
import sys
import time

import rclpy
from peer import answer, spin_until

process, name, topic = int(sys.argv[1]), sys.argv[2], sys.argv[3]
rclpy.init()
node = rclpy.create_node("watcher")


def there():
    return name in node.get_node_names(), node.count_publishers(topic)


spin_until(node, lambda: there() == (True, 1), f"{name} and {topic}", 30.0)
os.kill(process, signal.SIGINT)
begin = time.monotonic()
spin_until(node, lambda: there() == (False, 0), f"{name} and {topic} gone, but {there()}", 30.0)
answer({"seconds": time.monotonic() - begin})
rclpy.shutdown()
