"""Uses all parameter services of a node: parameters.py NODE NAME VALUE

Gets, describes and sets NAME, and answers with what each said; VALUE is JSON.
"""

import json
import sys

import rclpy
from peer import GUARD, answer, plain, spin_until
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

target, name, value = sys.argv[1:]
rclpy.init()
node = rclpy.create_node("asker")
client = AsyncParameterClient(node, target)
if not client.wait_for_services(timeout_sec=GUARD):
    sys.exit(f"{target} has no parameter services")


def ask(future):
    spin_until(node, future.done, f"an answer of {target}")
    return future.result()


def get():
    return parameter_value_to_python(ask(client.get_parameters([name])).values[0])


before = get()
result = ask(client.set_parameters([Parameter(name, value=json.loads(value))])).results[0]
answer(
    {
        "names": ask(client.list_parameters([], 0)).result.names,
        "types": list(ask(client.get_parameter_types([name])).types),
        "descriptor": plain(ask(client.describe_parameters([name])).descriptors[0]),
        "before": before,
        "set": {"successful": result.successful, "reason": result.reason},
        "after": get(),
    }
)
rclpy.shutdown()
