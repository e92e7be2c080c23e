"""Starts nodes again and again beside a participant that lives on, on a busy machine: does it come to know all of them?

    starts.py ROUNDS LOAD NAME=EXECUTABLE ...

In every round all executables are started at once; 5 s later, each must be in the graph by its name, and every publisher of
/rosout and /parameter_events must have a node. LOAD processes compute meanwhile. Answers with what was missing, and after how
many seconds the last node was known.
"""

import json
import signal
import subprocess
import sys
import time

import rclpy
from rclpy.node import Node

PATIENCE_S = 5.0
UNKNOWN = "_CREATED_BY_BARE_DDS_APP_"

rounds, load = int(sys.argv[1]), int(sys.argv[2])
executables = dict(argument.split("=", 1) for argument in sys.argv[3:])
rclpy.init()
watcher = Node("watcher")


def missing():
    known = set(watcher.get_node_names())
    lacking = [name for name in executables if name not in known]
    for topic in ("/rosout", "/parameter_events"):
        publishers = [info.node_name for info in watcher.get_publishers_info_by_topic(topic)]
        lacking += [f"{topic} of {name}" for name in executables if name not in publishers]
        lacking += [f"a node of {topic}" for name in publishers if name == UNKNOWN]
    return lacking


def until(condition, seconds):
    begin = time.monotonic()
    while not condition():
        if time.monotonic() - begin > seconds:
            return None
        rclpy.spin_once(watcher, timeout_sec=0.02)
    return time.monotonic() - begin


busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(load)]
answer = {"rounds": rounds, "missing": [], "known_after_s": []}
try:
    for number in range(rounds):
        nodes = [
            subprocess.Popen([path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for path in executables.values()
        ]
        seconds = until(lambda: not missing(), PATIENCE_S)
        if seconds is None:
            late = until(lambda: not missing(), 60.0)
            answer["missing"].append({"round": number, "what": missing(), "late_s": late})
        else:
            answer["known_after_s"].append(round(seconds, 3))
        for node in nodes:
            node.send_signal(signal.SIGINT)
        for node in nodes:
            node.wait()
        until(lambda: not set(executables) & set(watcher.get_node_names()), 60.0)
finally:
    for process in busy:
        process.kill()
print(json.dumps(answer))
