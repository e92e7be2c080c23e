"""Simulated ship, table and IMU; the scheme is run, calibrated and navigated on. Nothing real is needed.

    ros2 launch rotary_sins demo.launch.py speed:=20.0 scheme:=eight-position
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def config(name):
    return PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"])


def node(name, **parameters):
    return Node(
        package="rotary_sins",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[config(name), parameters],
    )


def generate_launch_description():
    number = lambda name: ParameterValue(LaunchConfiguration(name), value_type=float)
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes and topics"),
            DeclareLaunchArgument("speed", default_value="1.0", description="Simulated seconds a second"),
            DeclareLaunchArgument("heading_deg", default_value="0.0", description="Heading of the ship"),
            DeclareLaunchArgument("scheme", default_value="eight-position", description="Name or YAML file"),
            node("imu_simulator", speed=number("speed"), heading_deg=number("heading_deg")),
            node("scheme_sequencer", use_sim_time=True, scheme=LaunchConfiguration("scheme")),
            node("self_calibrator", use_sim_time=True),
            node("navigation_compensator", use_sim_time=True),
        ]
    )
