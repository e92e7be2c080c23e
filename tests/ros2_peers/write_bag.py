"""Writes a bag with `rosbags`: write_bag.py FROM TO

Every message of FROM is taken apart and put together again by that library, into an MCAP bag of its own making.
"""

import pathlib
import sys

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer

source, target = (pathlib.Path(argument) for argument in sys.argv[1:3])
count = 0
with AnyReader([source]) as reader, Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    store = reader.typestore
    written = {
        connection.topic: writer.add_connection(connection.topic, connection.msgtype, typestore=store)
        for connection in reader.connections
    }
    for connection, time, payload in reader.messages():
        message = store.deserialize_cdr(payload, connection.msgtype)
        writer.write(written[connection.topic], time, store.serialize_cdr(message, connection.msgtype))
        count += 1
print(count)
