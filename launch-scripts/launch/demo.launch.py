"""Simulated ship, table and IMU; the scheme is run, calibrated and navigated on. Nothing real is needed.

    ros2 launch rotary_sins demo.launch.py speed:=20.0 scheme:=eight-position

Everything ends where the simulation ends, or where a node does.
"""

import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

# Argument: type of its value, what it is. Empty: as the parameter files say.
ARGUMENTS = {
    "namespace": (str, "Namespace of all nodes and topics"),
    "params_file": (str, "Parameter file that goes before those of the package"),
    "log_level": (str, "debug, info, warn or error"),
    "speed": (float, "Simulated seconds a second"),
    "heading_deg": (float, "Heading of the ship"),
    "scheme": (str, "Name or YAML file"),
}


def start(context):
    given = {}
    for name, (kind, _) in ARGUMENTS.items():
        text = LaunchConfiguration(name).perform(context)
        if text:
            given[name] = kind(text)
    file = given.get("params_file")
    if file and not pathlib.Path(file).is_file():
        raise RuntimeError(f"params_file: {file} is no file")

    def node(name, *arguments, **parameters):
        config = PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"])
        told = {argument: given[argument] for argument in arguments if argument in given}
        return Node(
            package="rotary_sins",
            executable=name,
            name=name,
            namespace=given.get("namespace", ""),
            output="screen",
            parameters=[config, *filter(None, (parameters, file, told))],
            ros_arguments=["--log-level", given.get("log_level", "info")],
            on_exit=Shutdown(reason=f"{name} has ended"),
        )

    return [
        node("imu_simulator", "speed", "heading_deg"),
        # The table is simulated: nobody has to be asked before it turns.
        node("scheme_sequencer", "scheme", use_sim_time=True, autostart=True),
        node("self_calibrator", use_sim_time=True),
        node("navigation_compensator", use_sim_time=True),
    ]


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument(name, default_value="", description=description)
        for name, (_, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start)])
