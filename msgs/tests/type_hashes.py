"""Prints 'name hash' for every message definition of this package, computed by the `rosbags` library from the .msg files."""

import pathlib
import sys

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

here = pathlib.Path(__file__).resolve().parent.parent
files = {f"{p.parent.name}/msg/{p.stem}": p for p in here.glob("interfaces/definitions/*/*.msg")}
files |= {f"rotary_sins_msgs/msg/{p.stem}": p for p in here.glob("msg/*.msg")}

store = get_typestore(Stores.EMPTY)
for name, path in files.items():
    store.register(get_types_from_msg(path.read_text(), name))

reference = get_typestore(Stores.ROS2_JAZZY)
for name in files:
    ours = store.hash_rihs01(name)
    if name in reference.types and reference.hash_rihs01(name) != ours:
        sys.exit(f"{name}: definition differs from the one of ROS 2 Jazzy")
    print(name, ours)
