"""Reads a bag with two libraries that are not ours: read_bag.py BAG MAXIMUM

`rosbags` reads the folder as rosbag2 does, metadata.yaml included; `mcap-ros2-support` reads the MCAP file. They must
find the same messages. Answers with each topic's type, count, QoS and its first MAXIMUM messages.
"""

import json
import pathlib
import sys

from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

bag = pathlib.Path(sys.argv[1])
maximum = int(sys.argv[2])


def plain_rosbags(value):
    if hasattr(value, "__msgtype__"):
        names = [name for name in value.__dataclass_fields__ if not name.startswith("_") and not name.isupper()]
        return {name: plain_rosbags(getattr(value, name)) for name in names}
    if isinstance(value, (str, bool, int, float)):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain_rosbags(element) for element in value]


def plain_mcap(value):
    if hasattr(value, "__slots__"):
        return {name: plain_mcap(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (str, bool, int, float)):
        return value
    return [plain_mcap(element) for element in value]


topics = {}
with AnyReader([bag]) as reader:
    for connection in reader.connections:
        topics[connection.topic] = {
            "type": connection.msgtype,
            "count": connection.msgcount,
            "qos": [
                {"reliability": profile.reliability.name, "durability": profile.durability.name}
                for profile in connection.ext.offered_qos_profiles
            ],
            "messages": [],
        }
    order = []
    for connection, time, payload in reader.messages():
        messages = topics[connection.topic]["messages"]
        if len(messages) < maximum:
            messages.append(plain_rosbags(reader.deserialize(payload, connection.msgtype)))
        order.append((connection.topic, time))

seen = {name: 0 for name in topics}
again = []
for message in read_ros2_messages(next(bag.glob("*.mcap"))):
    name = message.channel.topic
    at = seen[name]
    seen[name] += 1
    again.append((name, message.log_time_ns))
    if at < maximum and plain_mcap(message.ros_msg) != topics[name]["messages"][at]:
        sys.exit(f"{name}: message {at} differs between the libraries")
if sorted(again) != sorted(order):
    sys.exit("the libraries found other messages")
for name, topic in topics.items():
    if topic["count"] != seen[name]:
        sys.exit(f"{name}: metadata.yaml says {topic['count']} messages, the file has {seen[name]}")
print(json.dumps(topics))
