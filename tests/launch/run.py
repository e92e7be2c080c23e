"""Runs a launch file of this project without ROS 2's own launch, which PyPI does not have.

    run.py PREFIX FILE [name:=value ...]

Stands in for the part of `launch` and `launch_ros` that the files use: declared arguments, an OpaqueFunction, nodes and
processes with their parameters, remappings and namespace, on_exit, timers and a shutdown. What a node is started with is
written as launch writes it; every start, end and shutdown is a line on standard output. Whatever else a file names is an
error here, not something passed over.
"""

import asyncio
import os
import pathlib
import runpy
import signal
import sys
import tempfile
import types

PREFIX = pathlib.Path(sys.argv[1])
ARGUMENTS = dict(argument.split(":=", 1) for argument in sys.argv[3:])
# Time from SIGINT to SIGKILL [s].
GRACE_S = 60


def say(line):
    print(line, flush=True)


class Value:
    """A substitution: known when the launch runs."""

    def __init__(self, perform):
        self.perform = perform


def text(value):
    if isinstance(value, (list, tuple)):
        return "".join(text(part) for part in value)
    return value.perform(None) if isinstance(value, Value) else str(value)


def argument(name):
    if name not in declared:
        sys.exit(f"launch configuration '{name}' does not exist")
    return ARGUMENTS.get(name, declared[name])


def LaunchConfiguration(name):
    return Value(lambda _: argument(name))


def PathJoinSubstitution(parts):
    return Value(lambda _: os.path.join(*map(text, parts)))


def FindPackagePrefix(package):
    assert package == "rotary_sins", package
    return Value(lambda _: str(PREFIX))


def FindPackageShare(package):
    assert package == "rotary_sins", package
    return Value(lambda _: str(PREFIX / "share" / package))


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description):
        self.name, self.default = name, default_value

    def run(self):
        if self.default is None and self.name not in ARGUMENTS:
            sys.exit(f"Required launch argument '{self.name}' was not provided")
        declared[self.name] = self.default if self.default is None else text(self.default)


class OpaqueFunction:
    def __init__(self, *, function):
        self.function = function

    def run(self):
        run(self.function(types.SimpleNamespace()))


class LogInfo:
    def __init__(self, *, msg):
        self.msg = msg

    def run(self):
        say(text(self.msg))


class Shutdown:
    def __init__(self, *, reason):
        self.reason = reason

    def run(self):
        if not over.is_set():
            say(f"shutdown: {self.reason}")
            over.set()


class TimerAction:
    def __init__(self, *, period, actions):
        self.period, self.actions = period, actions

    def run(self):
        tasks.append(asyncio.create_task(self.wait()))

    async def wait(self):
        await asyncio.sleep(self.period)
        if not over.is_set():
            run(self.actions)


class ExecuteProcess:
    def __init__(self, *, cmd, output, on_exit=None, name="process"):
        self.cmd, self.on_exit, self.name = cmd, on_exit, name

    def run(self):
        tasks.append(asyncio.create_task(self.live()))

    async def live(self):
        command = [text(part) for part in self.cmd]
        process = await asyncio.create_subprocess_exec(*command, start_new_session=True)
        say(f"started {self.name} {process.pid}: {' '.join(command)}")
        running[self] = process
        status = await process.wait()
        del running[self]
        say(f"ended {self.name}: {status}")
        if not over.is_set() and self.on_exit is not None:
            event = types.SimpleNamespace(returncode=status)
            run(self.on_exit(event, None) if callable(self.on_exit) else self.on_exit)


class Node(ExecuteProcess):
    def __init__(
        self, *, package, executable, name, output, namespace="", parameters=(), remappings=(), ros_arguments=(), on_exit=None
    ):
        assert package == "rotary_sins", package
        command = [str(PREFIX / "lib" / package / executable), "--ros-args", "-r", f"__node:={name}"]
        if text(namespace):
            command += ["-r", f"__ns:=/{text(namespace).strip('/')}"]
        for part in parameters:
            if isinstance(part, dict):
                part = parameter_file(part)
            command += ["--params-file", part]
        for default, other in remappings:
            command += ["-r", f"{default}:={text(other)}"]
        super().__init__(cmd=command + list(ros_arguments), output=output, on_exit=on_exit, name=executable)


def parameter_file(values):
    """launch_ros hands a dictionary on as a file for every node."""
    lines = ["/**:", "  ros__parameters:"]
    for key, value in values.items():
        value = str(value).lower() if isinstance(value, bool) else repr(value)
        lines.append(f"    {key}: {value}")
    if not values:
        lines[-1] += " {}"
    with tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False, dir=folder) as file:
        file.write("\n".join(lines) + "\n")
    return file.name


def run(actions):
    for action in actions if isinstance(actions, (list, tuple)) else [actions]:
        action.run()


async def launch(actions):
    global over
    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGINT, lambda: Shutdown(reason="ctrl-c").run())
    run(actions)
    await over.wait()
    for process in list(running.values()):
        process.send_signal(signal.SIGINT)
    waiting = [process.wait() for process in running.values()]
    if waiting:
        _, late = await asyncio.wait(map(asyncio.ensure_future, waiting), timeout=GRACE_S)
        for process in list(running.values()):
            process.kill()
        say(f"{len(late)} were killed")


def module(name, **members):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(members)


declared, running, tasks = {}, {}, []
folder = tempfile.mkdtemp(prefix="launch_")
module("launch", LaunchDescription=list)
module(
    "launch.actions",
    DeclareLaunchArgument=DeclareLaunchArgument,
    ExecuteProcess=ExecuteProcess,
    LogInfo=LogInfo,
    OpaqueFunction=OpaqueFunction,
    Shutdown=Shutdown,
    TimerAction=TimerAction,
)
module("launch.substitutions", LaunchConfiguration=LaunchConfiguration, PathJoinSubstitution=PathJoinSubstitution)
module("launch_ros", actions=None)
module("launch_ros.actions", Node=Node)
module("launch_ros.substitutions", FindPackagePrefix=FindPackagePrefix, FindPackageShare=FindPackageShare)
description = runpy.run_path(sys.argv[2])["generate_launch_description"]()
known = {action.name for action in description if isinstance(action, DeclareLaunchArgument)}
unknown = ARGUMENTS.keys() - known
if unknown:
    sys.exit(f"unknown arguments: {', '.join(sorted(unknown))}; known are {', '.join(sorted(known))}")
asyncio.run(launch(description))
