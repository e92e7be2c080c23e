"""RViz with the ship, the table and the IMU turning; beside a running demo, your hardware or a replay.

    ros2 launch rotary_sins view.launch.py

Foxglove takes the same model from the topic robot_description: `rviz:=false` publishes it without RViz.
"""

import pathlib

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    share = pathlib.Path(get_package_share_directory("rotary_sins"))
    return LaunchDescription(
        [
            DeclareLaunchArgument("rviz", default_value="true", description="Start RViz"),
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of the nodes that are shown"),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn or error"),
            # Only for the model: the frames come from navigation_compensator, so those of this node go nowhere.
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                namespace=LaunchConfiguration("namespace"),
                ros_arguments=["--log-level", LaunchConfiguration("log_level")],
                parameters=[{"robot_description": (share / "urdf" / "turntable.urdf").read_text()}],
                remappings=[("/tf", "~/tf"), ("/tf_static", "~/tf_static")],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                namespace=LaunchConfiguration("namespace"),
                arguments=["-d", str(share / "layouts" / "turntable.rviz")],
                ros_arguments=["--log-level", LaunchConfiguration("log_level")],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
