"""A recorded bag through the calibrator and the compensator, at any speed.

    ros2 launch rotary_sins replay.launch.py bag:=/data/calibration.mcap rate:=20

The topics are those of the bag: imu must be in it, the others are played where they are. Everything ends linger_s after the
last message.
"""

import pathlib
import runpy
import types

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackagePrefix

suite = types.SimpleNamespace(**runpy.run_path(str(pathlib.Path(__file__).with_name("suite.py"))))

# What sensors and ship said. What nodes said in the recorded run is not played: they say it anew.
# Argument: name in the suite, name in the bag by default, what it is.
TOPICS = {
    "imu": ("imu/data_raw", "/imu/data_raw", "sensor_msgs/Imu of the block"),
    "joint_states": ("turntable/joint_states", "/turntable/joint_states", "sensor_msgs/JointState of the table"),
    "fix": ("fix", "/fix", "sensor_msgs/NavSatFix of the ship"),
    "velocity": ("aiding/velocity", "/aiding/velocity", "geometry_msgs/TwistWithCovarianceStamped of the ship"),
    "scheme_status": ("scheme/status", "/scheme/status", "rotary_sins_msgs/SchemeStatus"),
}
# Argument: type of its value, what it is. Empty: as the parameter files say.
ARGUMENTS = {
    **suite.COMMON,
    "outer_axis": (str, "Block axis of the outer joint"),
    "inner_axis": (str, "Block axis of the inner joint"),
    "velocity_reference": (str, "moored, measured, position or auto: what the filter takes for the ship's velocity"),
    "angle_random_walk_deg_per_sqrt_hour": (float, "Noise of the gyroscopes, where the samples do not tell it"),
    "velocity_random_walk_ug_per_sqrt_hz": (float, "Noise of the accelerometers, where the samples do not tell it"),
}
PARAMETERS = tuple(ARGUMENTS)[len(suite.COMMON) :]


def start(context):
    given = suite.given(context, ARGUMENTS)

    def node(name):
        return suite.node(
            name,
            given,
            *PARAMETERS,
            ours={"use_sim_time": True},
            remappings=[(topic, LaunchConfiguration(argument)) for argument, (topic, _, _) in TOPICS.items()],
            on_exit=Shutdown(reason=f"{name} has ended"),
        )

    def played(event, _):
        if event.returncode != 0:
            return Shutdown(reason=f"the bag could not be played: status {event.returncode}")
        linger_s = float(LaunchConfiguration("linger_s").perform(context))
        return TimerAction(period=linger_s, actions=[Shutdown(reason="the bag has been played")])

    topics = {argument: LaunchConfiguration(argument).perform(context) for argument in TOPICS}
    imu = topics.pop("imu")
    program = PathJoinSubstitution([FindPackagePrefix("rotary_sins"), "lib", "rotary_sins", "rotary-sins"])
    play = ExecuteProcess(
        cmd=[
            program,
            "play",
            LaunchConfiguration("bag"),
            "--rate",
            LaunchConfiguration("rate"),
            "--wait-for",
            imu + ":2",
            "--topics",
            imu,
            "--optional-topics",
            *topics.values(),
        ],
        output="screen",
        on_exit=played,
    )
    return [node("self_calibrator"), node("navigation_compensator"), play]


def generate_launch_description():
    topics = [
        DeclareLaunchArgument(name, default_value=default, description=description + ", as the bag names it")
        for name, (_, default, description) in TOPICS.items()
    ]
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="MCAP file or rosbag2 folder"),
            DeclareLaunchArgument("rate", default_value="1", description="Multiple of real time; 0 or max: at most"),
            DeclareLaunchArgument("linger_s", default_value="5.0", description="Time for the nodes after the last message"),
            *topics,
            *suite.declared(ARGUMENTS),
            OpaqueFunction(function=start),
        ]
    )
