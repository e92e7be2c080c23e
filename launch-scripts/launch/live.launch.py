"""A real IMU and table: the sequencer turns the table, the calibrator and the compensator listen.

The IMU's driver publishes sensor_msgs/Imu, the table takes trajectory_msgs/JointTrajectory and publishes
sensor_msgs/JointState (a ros2_control joint_trajectory_controller does both), the ship publishes sensor_msgs/NavSatFix.

    ros2 launch rotary_sins live.launch.py imu:=/imu/data_raw joint_states:=/table/joint_states \
        joint_trajectory:=/table_controller/joint_trajectory fix:=/gps/fix outer_axis:=x inner_axis:=y
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

TOPICS = {
    "imu": ("imu/data_raw", "sensor_msgs/Imu of the block"),
    "joint_states": ("turntable/joint_states", "sensor_msgs/JointState with outer_joint and inner_joint"),
    "joint_trajectory": ("turntable/joint_trajectory", "trajectory_msgs/JointTrajectory that the table follows"),
    "fix": ("fix", "sensor_msgs/NavSatFix of the ship"),
}


def node(name, **parameters):
    return Node(
        package="rotary_sins",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[
            PathJoinSubstitution([FindPackageShare("rotary_sins"), "config", name + ".yaml"]),
            parameters,
        ],
        remappings=[(default, LaunchConfiguration(argument)) for argument, (default, _) in TOPICS.items()],
    )


def generate_launch_description():
    axes = {axis: LaunchConfiguration(axis) for axis in ("outer_axis", "inner_axis")}
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in TOPICS.items()
    ]
    return LaunchDescription(
        arguments
        + [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes and topics"),
            DeclareLaunchArgument("scheme", default_value="eight-position", description="Name or YAML file"),
            DeclareLaunchArgument("outer_axis", default_value="x", description="Block axis of the outer joint"),
            DeclareLaunchArgument("inner_axis", default_value="y", description="Block axis of the inner joint"),
            node("scheme_sequencer", scheme=LaunchConfiguration("scheme"), **axes),
            node("self_calibrator", **axes),
            node("navigation_compensator", **axes),
        ]
    )
