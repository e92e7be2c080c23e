"""Moves a table by its FollowJointTrajectory action: follow.py CASE [CASE ...]

Answers with what became of each case, by name.
"""

import sys
import uuid

import rclpy
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Duration, Time
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from peer import answer, message_type, plain, reliable, spin_until, trajectory, watch_joints
from rclpy.action import ActionClient
from trajectory_msgs.msg import JointTrajectory
from unique_identifier_msgs.msg import UUID

ACTION = "/turntable/follow_joint_trajectory"
NAMES = ["outer_joint", "inner_joint"]

rclpy.init()
node = rclpy.create_node("mover")
# Feedback comes forty times a second; what waits while this process stands still is kept.
client = ActionClient(node, FollowJointTrajectory, ACTION, feedback_sub_qos_profile=reliable())
results = node.create_client(FollowJointTrajectory.Impl.GetResultService, f"{ACTION}/_action/get_result")
cancels = node.create_client(CancelGoal, f"{ACTION}/_action/cancel_goal")
topic = node.create_publisher(JointTrajectory, "/turntable/joint_trajectory", reliable(10))
table = watch_joints(node)
spin_until(node, client.server_is_ready, "a table that serves the action")
spin_until(
    node,
    lambda: table and topic.get_subscription_count() and results.service_is_ready() and cancels.service_is_ready(),
    "a table that listens and reports",
)


def wait(future, what):
    spin_until(node, future.done, what)
    return future.result()


def from_here(seconds, target, names=NAMES):
    return trajectory(table["position"], target, seconds, names)


class Motion:
    """A goal that was sent, and what is heard of it."""

    def __init__(self, goal, identity=None):
        self.feedback = []
        call = client.send_goal_async(
            goal, feedback_callback=lambda message: self.feedback.append(plain(message.feedback)), goal_uuid=identity
        )
        self.handle = wait(call, "an answer to the goal")

    def end(self):
        response = wait(self.handle.get_result_async(), "a result")
        return {
            "accepted": self.handle.accepted,
            "status": response.status,
            "code": response.result.error_code,
            "text": response.result.error_string,
            "feedback": len(self.feedback),
        }


def goal(seconds, target):
    return FollowJointTrajectory.Goal(trajectory=from_here(seconds, target))


def rest():
    spin_until(node, lambda: table["velocity"] == [0.0, 0.0], "the table rests")
    # One more joint state, so that the position is that of rest.
    last = table.pop("position")
    spin_until(node, lambda: "position" in table, "a joint state")
    return last


def reached():
    # Once one feedback has come, the table knows this client's reader, and none is lost from its first one on.
    matched = Motion(goal(30, table["position"]))
    spin_until(node, lambda: matched.feedback, "feedback")
    wait(matched.handle.cancel_goal_async(), "an answer to the cancel")
    matched.end()
    rest()
    motion = Motion(goal(2, [0.3, -0.2]))
    # rclpy drops what comes after the result.
    spin_until(node, lambda: len(motion.feedback) >= 15, "the feedback of a motion")
    end = motion.end()
    rest()
    late = wait(motion.handle.get_result_async(), "the result once more")
    return end | {
        "position": table["position"],
        "middle": motion.feedback[len(motion.feedback) // 2],
        "late": [late.status, late.result.error_code],
    }


def positions():
    """Points without rates, as a joint_trajectory_controller takes them."""
    wanted = goal(2, [0.1, 0.2])
    for point in wanted.trajectory.points:
        point.velocities = []
    end = Motion(wanted).end()
    rest()
    return end | {"position": table["position"]}


def changed(change):
    wanted = goal(2, [0.1, 0.1])
    change(wanted)
    return Motion(wanted).end()


def invalid():
    def joints(wanted):
        wanted.trajectory.joint_names = ["outer_joint", "elbow"]

    def times(wanted):
        wanted.trajectory.points[1].time_from_start = Duration()

    def numbers(wanted):
        wanted.trajectory.points[1].positions = [float("nan"), 0.0]

    def empty(wanted):
        wanted.trajectory.points = []

    def old(wanted):
        wanted.trajectory.header.stamp = Time(sec=1000)

    return {change.__name__: changed(change) for change in (joints, times, numbers, empty, old)}


def cancelled():
    motion = Motion(goal(30, [1.5, 0.0]))
    spin_until(node, lambda: len(motion.feedback) > 5, "feedback")
    response = wait(motion.handle.cancel_goal_async(), "an answer to the cancel")
    end = motion.end()
    rest()
    again = wait(motion.handle.cancel_goal_async(), "an answer to the second cancel")
    return end | {
        "cancels": [response.return_code, len(response.goals_canceling)],
        "again": again.return_code,
        "position": table["position"],
    }


def preempted():
    first = Motion(goal(30, [-1.5, 0.0]))
    spin_until(node, lambda: first.feedback, "feedback")
    second = Motion(goal(2, table["position"]))
    return {"first": first.end(), "second": second.end()}


def overruled():
    """By a trajectory of the topic."""
    motion = Motion(goal(30, [-1.5, 0.0]))
    spin_until(node, lambda: motion.feedback, "feedback")
    topic.publish(JointTrajectory(joint_names=NAMES))
    return motion.end()


def tolerance(names):
    return [JointTolerance(name=name, position=0.05) for name in names]


def off_the_path():
    wanted = goal(4, [0.5, 0.0])
    wanted.path_tolerance = tolerance(NAMES)
    return Motion(wanted).end()


def not_there():
    wanted = goal(2, [0.5, 0.0])
    wanted.goal_tolerance = tolerance(["outer_joint"])
    wanted.goal_time_tolerance = Duration(nanosec=500_000_000)
    return Motion(wanted).end()


def tolerated():
    wanted = goal(2, [0.5, 0.0])
    wanted.goal_tolerance = [JointTolerance(name="outer_joint", position=-1.0)]
    return Motion(wanted).end()


def unknown():
    identity = UUID(uuid=list(uuid.uuid4().bytes))
    request = FollowJointTrajectory.Impl.GetResultService.Request(goal_id=identity)
    response = wait(results.call_async(request), "the result of an unknown goal")
    cancel = CancelGoal.Request()
    cancel.goal_info.goal_id = identity
    return {"status": response.status, "cancel": wait(cancels.call_async(cancel), "a cancel").return_code}


def twice():
    """Two goals of one id, and what the latched status says afterwards."""
    identity = UUID(uuid=list(uuid.uuid4().bytes))
    first = Motion(goal(2, table["position"]), identity)
    second = Motion(goal(2, table["position"]), identity)
    end = first.end()
    statuses = []
    kind = message_type("action_msgs/msg/GoalStatusArray")
    assert kind is GoalStatusArray
    node.create_subscription(kind, f"{ACTION}/_action/status", statuses.append, reliable(1, latched=True))


    def mine():
        return [s.status for s in statuses[-1].status_list if s.goal_info.goal_id == identity] if statuses else []

    # Of a latched topic older messages may come first.
    spin_until(node, lambda: mine() == [end["status"]], "the latched status")
    return {"second": second.handle.accepted, "first": end, "statuses": mine()}


def all_of_them():
    motion = Motion(goal(30, [0.9, 0.0]))
    response = wait(cancels.call_async(CancelGoal.Request()), "a cancel of everything")
    return {"cancels": len(response.goals_canceling), "code": response.return_code} | motion.end()


cases = {}
for name in sys.argv[1:]:
    cases[name] = globals()[name]()
    rest()
answer(cases)
rclpy.shutdown()
