"""What the launch files of this folder have in common. They run it from beside them, in the source tree as in a prefix."""

import pathlib

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

# Argument: type of its value, what it is. Empty: as the parameter files say.
COMMON = {
    "namespace": (str, "Namespace of all nodes and of what they publish"),
    "params_file": (str, "Parameter file that goes before those of the package"),
    "log_level": (str, "debug, info, warn or error"),
}


def declared(arguments):
    """Arguments that may stay empty."""
    return [
        DeclareLaunchArgument(name, default_value="", description=description)
        for name, (_, description) in arguments.items()
    ]


def given(context, arguments):
    """Values of those that are not empty, by name."""
    values = {}
    for name, (kind, _) in arguments.items():
        text = LaunchConfiguration(name).perform(context)
        if text:
            values[name] = kind(text)
    file = values.get("params_file")
    if file and not pathlib.Path(file).is_file():
        raise RuntimeError(f"params_file: {file} is no file")
    return values


def node(name, values, *, ours=None, told=None, remappings=(), on_exit):
    """A node with its file of parameters, then what the launch file says, the user's file, and the user's arguments."""
    config = PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"])
    return Node(
        package="rotary_sins",
        executable=name,
        name=name,
        namespace=values.get("namespace", ""),
        output="screen",
        parameters=[config, *filter(None, (ours, values.get("params_file"), told))],
        remappings=remappings,
        ros_arguments=["--log-level", values.get("log_level", "info")],
        on_exit=on_exit,
    )
