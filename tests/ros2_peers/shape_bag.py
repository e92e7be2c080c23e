"""Writes a bag in the shapes that other recorders give it: shape_bag.py FROM TO JSON

With the reference library of MCAP, which is not ours. JSON is an object of:
  compression   none, lz4 or zstd (default); unchunked: no chunks and no index at all
  parts         so many files, with a metadata.yaml beside them that names them
  overlap_s     the last so many seconds of a part stand, by turns, in the next one
  shuffled      metadata.yaml names the files in another order, and their names say nothing
  imu_topic     another name for the Imu's topic
  jitter        the stamps of the Imu are off by up to this part of an interval
  gap_s         after half of the bag so many seconds of the Imu are missing
  beside        other topics too: a second type of sensor, texts, an empty topic
  sqlite        an SQLite bag, written by `rosbags`

Answers with the number of messages.
"""

import json
import pathlib
import random
import struct
import sys

from mcap.writer import CompressionType, IndexType, Writer
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

IMU = "/imu/data_raw"
SECOND = 1_000_000_000

source, target = (pathlib.Path(argument) for argument in sys.argv[1:3])
shape = json.loads(sys.argv[3])


def shifted(payload, nanoseconds):
    """The message with its stamp moved; it begins with one, behind four bytes of encapsulation."""
    payload = bytearray(payload)
    sec, nanosec = struct.unpack_from("<iI", payload, 4)
    stamp = sec * SECOND + nanosec + nanoseconds
    struct.pack_into("<iI", payload, 4, stamp // SECOND, stamp % SECOND)
    return bytes(payload)


def messages(reader):
    """Topic, type, schema, time and payload, with the faults of the shape."""
    noise = random.Random(1)
    imu = [t for c, t, _ in reader.messages() if c.topic == IMU]
    interval = (imu[-1] - imu[0]) / (len(imu) - 1)
    middle = (imu[0] + imu[-1]) // 2
    gap = range(middle, middle + int(shape.get("gap_s", 0) * SECOND))
    beside = shape.get("beside", False)
    for number, (connection, time, payload) in enumerate(reader.messages()):
        topic = connection.topic
        if topic == IMU:
            if time in gap:
                continue
            off = round(interval * shape.get("jitter", 0) * noise.uniform(-1, 1))
            payload, time = shifted(payload, off), time + off
            topic = shape.get("imu_topic", IMU)
        yield topic, connection.msgtype, connection.msgdef.data, time, bytes(payload)
        if beside and number % 500 == 0:
            text = f"line {number}\0".encode()
            payload = b"\0\1\0\0" + struct.pack("<I", len(text)) + text
            yield "/log/text", "std_msgs/msg/String", "string data\n", time, payload
            payload = b"\0\1\0\0" + struct.pack("<iII", time // SECOND, time % SECOND, 1) + b"\0" + bytes(3) + struct.pack("<dd", 21.5, 0)
            schema = "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n" + "=" * 80
            schema += "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80
            schema += "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
            yield "/engine/temperature", "sensor_msgs/msg/Temperature", schema, time, payload


class Part:
    """One MCAP file."""

    def __init__(self, path):
        self.path, self.count, self.ids = path, 0, {}
        compression = shape.get("compression", "zstd")
        self.stream = path.open("wb")
        if compression == "unchunked":
            self.writer = Writer(
                self.stream, use_chunking=False, index_types=IndexType.NONE, use_statistics=False,
                use_summary_offsets=False, repeat_channels=False, repeat_schemas=False,
            )
        else:
            self.writer = Writer(self.stream, chunk_size=200_000, compression=CompressionType[compression.upper()])
        self.writer.start(profile="ros2", library="shape_bag")
        if shape.get("beside"):
            self.channel("/never/heard", "std_msgs/msg/String", "string data\n")

    def channel(self, topic, kind, schema):
        if topic not in self.ids:
            number = self.writer.register_schema(kind, "ros2msg", schema.encode())
            self.ids[topic] = self.writer.register_channel(topic, "cdr", number, {"offered_qos_profiles": ""})
        return self.ids[topic]

    def write(self, topic, kind, schema, time, payload):
        self.count += 1
        self.writer.add_message(self.channel(topic, kind, schema), time, payload, time)

    def close(self):
        self.writer.finish()
        self.stream.close()


def write_mcap(reader):
    parts = shape.get("parts", 1)
    target.mkdir(parents=True)
    names = [f"{target.name}_{number}.mcap" for number in range(parts)]
    if shape.get("shuffled"):
        names = [f"part_{(7 * number + 3) % 10}.mcap" for number in range(parts)]
    files = [Part(target / name) for name in names]
    span, overlap = reader.end_time - reader.start_time, shape.get("overlap_s", 0) * SECOND
    for number, message in enumerate(messages(reader)):
        place = (message[3] - reader.start_time) * parts / (span + 1)
        at = min(max(int(place), 0), parts - 1)
        ahead = (at + 1) * (span + 1) // parts - (message[3] - reader.start_time)
        if at + 1 < parts and ahead < overlap and number % 2:
            at += 1
        files[at].write(*message)
    for part in files:
        part.close()
    if parts > 1:
        listed = sorted(names) if shape.get("shuffled") else names
        lines = ["rosbag2_bagfile_information:", "  version: 9", "  storage_identifier: mcap", "  relative_file_paths:"]
        lines += [f"    - {name}" for name in listed]
        lines += ["  compression_format: ''", "  compression_mode: ''"]
        (target / "metadata.yaml").write_text("\n".join(lines) + "\n")
    return sum(part.count for part in files)


def write_sqlite(reader):
    with RosbagsWriter(target, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        known = {c.topic: writer.add_connection(c.topic, c.msgtype, typestore=reader.typestore) for c in reader.connections}
        count = 0
        for connection, time, payload in reader.messages():
            writer.write(known[connection.topic], time, payload)
            count += 1
    return count


with AnyReader([source]) as reader:
    print(write_sqlite(reader) if shape.get("sqlite") else write_mcap(reader))
