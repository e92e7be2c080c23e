"""What the launch files of this folder have in common. They run it by its place beside them, in a prefix or not."""

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
    """Their values by name; None: empty."""
    values = {}
    for name, (kind, _) in arguments.items():
        text = LaunchConfiguration(name).perform(context)
        values[name] = kind(text) if text else None
    file = values["params_file"]
    if file and not pathlib.Path(file).is_file():
        raise RuntimeError(f"params_file: {file} is no file")
    return values


def node(name, values, *arguments, ours=None, kept=None, remappings=(), on_exit):
    """A node with its parameters: its file, ours, the user's file, these arguments, where it keeps its state."""
    config = PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"])
    told = {argument: values[argument] for argument in arguments if values[argument] is not None}
    return Node(
        package="rotary_sins",
        executable=name,
        name=name,
        namespace=values["namespace"] or "",
        output="screen",
        parameters=[config, *filter(None, (ours, values["params_file"], told, kept))],
        remappings=remappings,
        ros_arguments=["--log-level", values["log_level"] or "info"],
        on_exit=on_exit,
    )
