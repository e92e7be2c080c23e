"""A real IMU and table: the sequencer turns the table when it is asked to, the calibrator and the compensator listen.

The IMU's driver publishes sensor_msgs/Imu, the table takes trajectory_msgs/JointTrajectory or
control_msgs/FollowJointTrajectory and publishes sensor_msgs/JointState (a ros2_control joint_trajectory_controller does
all of it), the ship publishes sensor_msgs/NavSatFix.

    ros2 launch rotary_sins live.launch.py imu:=/imu/data_raw joint_states:=/table/joint_states \
        joint_trajectory:=/table_controller/joint_trajectory fix:=/gps/fix outer_axis:=x inner_axis:=y
    ros2 service call /scheme_sequencer/start std_srvs/srv/Trigger

A launch moves nothing: the scheme waits for the call. A node that fails is started again and goes on from its checkpoint,
where checkpoint_folder names a place for it.
"""

import pathlib
import runpy
import types

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration

suite = types.SimpleNamespace(**runpy.run_path(str(pathlib.Path(__file__).with_name("suite.py"))))

# Argument: name in the suite, what it is.
TOPICS = {
    "imu": ("imu/data_raw", "sensor_msgs/Imu of the block"),
    "joint_states": ("turntable/joint_states", "sensor_msgs/JointState with outer_joint and inner_joint"),
    "joint_trajectory": ("turntable/joint_trajectory", "trajectory_msgs/JointTrajectory that the table follows"),
    "follow_joint_trajectory": (
        "turntable/follow_joint_trajectory",
        "Action that the table follows, with table_interface:=action",
    ),
    "fix": ("fix", "sensor_msgs/NavSatFix of the ship"),
    "velocity": (
        "aiding/velocity",
        "geometry_msgs/TwistWithCovarianceStamped of the ship, with velocity_reference:=measured",
    ),
}
# Argument: type of its value, what it is. Empty: as the parameter files say.
ARGUMENTS = {
    **suite.COMMON,
    "scheme": (str, "Name or YAML file"),
    "table_interface": (str, "topic or action"),
    "outer_axis": (str, "Block axis of the outer joint"),
    "inner_axis": (str, "Block axis of the inner joint"),
    "velocity_reference": (str, "moored, measured, position or auto: what the filter takes for the ship's velocity"),
    "angle_random_walk_deg_per_sqrt_hour": (float, "Noise of the gyroscopes, where the samples do not tell it"),
    "velocity_random_walk_ug_per_sqrt_hz": (float, "Noise of the accelerometers, where the samples do not tell it"),
    "checkpoint_folder": (str, "Folder in which the nodes keep their state and find it after a crash; empty: off"),
}
AXES = ("outer_axis", "inner_axis")
NOISE = ("angle_random_walk_deg_per_sqrt_hour", "velocity_random_walk_ug_per_sqrt_hz")
# Exit status of what no new start would mend: arguments, parameters, files.
UNUSABLE = 2
# Between a failure and the next start [s].
PAUSE_S = 2.0


def start(context):
    given = suite.given(context, ARGUMENTS)
    folder = given["checkpoint_folder"]
    remappings = [(default, LaunchConfiguration(argument)) for argument, (default, _) in TOPICS.items()]

    def node(name, *arguments, keeps=False):
        kept = None
        if keeps and folder:
            kept = {"checkpoint_file": str(pathlib.Path(folder) / (name + ".checkpoint"))}

        def ended(event, _):
            if event.returncode in (0, UNUSABLE):
                return Shutdown(reason=f"{name} has ended with status {event.returncode}")
            told_why = f"{name} has ended with status {event.returncode} and is started again"
            return [LogInfo(msg=told_why), TimerAction(period=PAUSE_S, actions=[node(name, *arguments, keeps=keeps)])]

        return suite.node(name, given, *arguments, kept=kept, remappings=remappings, on_exit=ended)

    return [
        node("scheme_sequencer", "scheme", "table_interface", *AXES, keeps=True),
        node("self_calibrator", "velocity_reference", *AXES, *NOISE, keeps=True),
        node("navigation_compensator", "velocity_reference", *AXES, *NOISE),
    ]


def generate_launch_description():
    topics = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in TOPICS.items()
    ]
    return LaunchDescription([*topics, *suite.declared(ARGUMENTS), OpaqueFunction(function=start)])
