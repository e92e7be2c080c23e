"""A recorded bag through the calibrator and the compensator, at any speed.

    ros2 launch rotary_sins replay.launch.py bag:=/data/calibration.mcap rate:=20
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackagePrefix, FindPackageShare

# What sensors and ship said. What nodes said in the recorded run is not played: they say it anew.
TOPICS = ["/imu/data_raw", "/turntable/joint_states", "/fix", "/scheme/status"]


def node(name):
    return Node(
        package="rotary_sins",
        executable=name,
        name=name,
        output="screen",
        parameters=[
            PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"]),
            {"use_sim_time": True},
        ],
    )


def generate_launch_description():
    program = PathJoinSubstitution([FindPackagePrefix("rotary_sins"), "lib", "rotary_sins", "rotary-sins"])
    play = ExecuteProcess(
        cmd=[
            program,
            "play",
            LaunchConfiguration("bag"),
            "--rate",
            LaunchConfiguration("rate"),
            "--wait-for",
            "/imu/data_raw:2",
            "--topics",
            *TOPICS,
        ],
        output="screen",
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="MCAP file or rosbag2 folder"),
            DeclareLaunchArgument("rate", default_value="1", description="Multiple of real time"),
            node("self_calibrator"),
            node("navigation_compensator"),
            play,
        ]
    )
