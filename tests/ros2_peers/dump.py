"""Writes the parameters of a node as `ros2 param dump` does: dump.py NODE FILE [NAME VALUE ...]

With NAME and VALUE (JSON) those parameters are set before, and the answer says whether all of them were.
"""

import json
import sys

import rclpy
import yaml
from peer import GUARD, answer, spin_until
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

target, file, *change = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("asker")
client = AsyncParameterClient(node, target)
if not client.wait_for_services(timeout_sec=GUARD):
    sys.exit(f"{target} has no parameter services")


def ask(future):
    spin_until(node, future.done, f"an answer of {target}")
    return future.result()


told = None
if change:
    wanted = [Parameter(name, value=json.loads(value)) for name, value in zip(change[::2], change[1::2])]
    results = ask(client.set_parameters(wanted)).results
    told = {
        "successful": all(result.successful for result in results),
        "reason": "; ".join(result.reason for result in results if result.reason),
    }
names = sorted(ask(client.list_parameters([], 0)).result.names)
values = [parameter_value_to_python(value) for value in ask(client.get_parameters(names)).values]
tree = {}
for name, value in zip(names, values):
    *path, last = name.split(".")
    branch = tree
    for part in path:
        branch = branch.setdefault(part, {})
    branch[last] = list(value) if hasattr(value, "tolist") or isinstance(value, (list, tuple)) else value
with open(file, "w") as out:
    yaml.dump({target: {"ros__parameters": tree}}, out, default_flow_style=False)
answer({"names": names, "set": told})
rclpy.shutdown()
