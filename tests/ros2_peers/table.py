"""A table that is moved by the FollowJointTrajectory action, with a will of its own: table.py

Runs the scheme of /scheme_sequencer once for each way a motion can go, and answers with what the sequencer said of it.
"""

import faulthandler
import os
import sys
import threading
import time

import rclpy
from action_msgs.srv import CancelGoal
from control_msgs.action import FollowJointTrajectory
from peer import GUARD, answer, reliable
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rotary_sins_msgs.msg import SchemeStatus
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

ACTION = "/turntable/follow_joint_trajectory"
NAMES = ["outer_joint", "inner_joint"]
UNDER_WAY = (SchemeStatus.WAITING_FOR_TABLE, SchemeStatus.DWELLING, SchemeStatus.ROTATING)

# Whatever locks up, in rclpy or beneath it: the program ends with where all its threads are.
faulthandler.dump_traceback_later(GUARD, exit=True)
rclpy.init()
group = ReentrantCallbackGroup()


class Spinning:
    """A node, and the thread that spins it."""

    def __init__(self, name):
        self.node = rclpy.create_node(name)
        self.executor = MultiThreadedExecutor(num_threads=8)
        self.executor.add_node(self.node)
        self.last = None
        self.gone = threading.Event()
        self.thread = threading.Thread(target=self.spin, daemon=True)

    def spin(self):
        while True:
            self.executor.spin_once(timeout_sec=0.1)
            if self.last and not self.gone.is_set():
                self.last()
                self.gone.set()

    def end_with(self, last):
        """Does this between two waits: what destroys a server in the midst of one races with it. The next lets go of it."""
        self.last = last
        self.gone.wait()


# Apart, so that what is destroyed in the one cannot end the other.
table, observer = Spinning("table"), Spinning("observer")
node = observer.node
state = {"way": "obey", "position": [0.0, 0.0], "moving": [0.0, 0.0], "goals": 0, "cancels": 0, "statuses": [], "asked": False, "asleep": False}
joint_states = node.create_publisher(JointState, "/turntable/joint_states", reliable(100))


def tell_joints():
    message = JointState(name=NAMES, position=state["position"], velocity=state["moving"])
    message.header.stamp = node.get_clock().now().to_msg()
    joint_states.publish(message)


def execute(goal):
    state["goals"] += 1
    state["goal"] = goal.request
    result = FollowJointTrajectory.Result()
    points = goal.request.trajectory.points
    order = [goal.request.trajectory.joint_names.index(name) for name in NAMES]
    stamp = goal.request.trajectory.header.stamp
    start = stamp.sec + stamp.nanosec * 1e-9 or time.time()
    end = start + points[-1].time_from_start.sec + points[-1].time_from_start.nanosec * 1e-9
    way = state["way"]
    begun = list(state["position"])
    target = [points[-1].positions[i] for i in order]
    while time.time() < end or way in ("hold", "never"):
        if state["way"] == "gone":
            state["asleep"] = True
            time.sleep(GUARD)
        if goal.is_cancel_requested:
            state["moving"] = [0.0, 0.0]
            goal.canceled()
            return result
        if way == "never" and state["way"] != "never":
            goal.abort()
            return result
        if way == "fail" and time.time() > start + 0.5:
            state["moving"] = [0.0, 0.0]
            goal.abort()
            result.error_code = FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
            result.error_string = "outer_joint slips"
            return result
        share = min(max((time.time() - start) / (end - start), 0.0), 1.0)
        if way in ("obey", "fail") and share > 0.0:
            state["position"] = [a + (b - a) * share for a, b in zip(begun, target)]
            state["moving"] = [(b - a) / (end - start) for a, b in zip(begun, target)]
        feedback = FollowJointTrajectory.Feedback(joint_names=NAMES)
        feedback.error.positions = [0.001, 0.0]
        goal.publish_feedback(feedback)
        time.sleep(0.02)
    state["position"] = target
    state["moving"] = [0.0, 0.0]
    goal.succeed()
    return result


def decide(_):
    if state["way"] == "late":
        state["asked"] = True
        wait(lambda: state["way"] != "late", "the table may answer")
    return GoalResponse.REJECT if state["way"] == "reject" else GoalResponse.ACCEPT


def decide_cancel(_):
    state["cancels"] += 1
    return CancelResponse.ACCEPT


def server():
    return ActionServer(
        table.node,
        FollowJointTrajectory,
        ACTION,
        execute,
        goal_callback=decide,
        cancel_callback=decide_cancel,
        callback_group=group,
    )


def wait(condition, what):
    while not condition():
        if not (observer.thread.is_alive() and (table.thread.is_alive() or table.gone.is_set())):
            give_up(f"an executor has ended before: {what}; {state}")
        time.sleep(0.02)


def give_up(why):
    """Ends the program, threads that sleep included."""
    print(why, file=sys.stderr, flush=True)
    os._exit(1)


def call(kind, name, request):
    client = node.create_client(kind, name, callback_group=group)
    wait(client.service_is_ready, name)
    future = client.call_async(request)
    wait(future.done, f"an answer of {name}")
    return future.result()


def ask(what):
    return call(Trigger, f"/scheme_sequencer/{what}", Trigger.Request()).success


def newest():
    return state["statuses"][-1] if state["statuses"] else SchemeStatus()


def run(way):
    """Starts the scheme with a table that goes this way, and waits until a goal has come."""
    state.update(way=way, position=[0.0, 0.0], moving=[0.0, 0.0], goals=0, cancels=0, statuses=[], asked=False)
    if not ask("start"):
        give_up(f"{way}: the scheme does not start")
    # What was said of the run before may still be under way: only what comes from the start on is of this one.
    wait(lambda: any(status.state in UNDER_WAY for status in state["statuses"]), f"{way}: the scheme is under way")
    while state["statuses"][0].state not in UNDER_WAY:
        state["statuses"].pop(0)
    if way == "late":
        wait(lambda: state["asked"], f"{way}: the table is asked")
    elif way != "reject":
        wait(lambda: state["goals"] > 0, f"{way}: a goal")


def fault(way):
    wait(lambda: newest().state == SchemeStatus.FAULT, f"{way}: a fault")
    return newest().message


def runs():
    found = {}
    run("obey")
    wait(lambda: newest().step >= 2 and newest().state == SchemeStatus.DWELLING, "two rotations")
    tolerance = state["goal"].goal_tolerance
    found["obey"] = {
        "goals": state["goals"],
        "names": [t.name for t in tolerance],
        "tolerance": [t.position for t in tolerance],
        "time": state["goal"].goal_time_tolerance.sec,
        "position": state["position"],
    }
    ask("abort")

    run("hold")
    paused = ask("pause")
    wait(lambda: state["cancels"] > 0, "the goal is cancelled")
    wait(lambda: newest().state == SchemeStatus.PAUSED, "paused")
    state["way"] = "obey"
    found["pause"] = {"paused": paused, "resumed": ask("resume")}
    wait(lambda: newest().step >= 1 and newest().state == SchemeStatus.DWELLING, "the rest of the rotation")
    ask("abort")

    for way in ("fail", "reject", "never"):
        run(way)
        found[way] = fault(way)
    # The fault is told before the goal is cancelled.
    wait(lambda: state["cancels"] > 0, "the motion without an end is cancelled")
    found["never cancelled"] = state["cancels"]

    # Aborted while the table still owes its answer; the goal that it then accepts is not wanted any more.
    run("late")
    aborted = ask("abort")
    wait(lambda: newest().state == SchemeStatus.ABORTED, "aborted")
    found["late"] = {"aborted": aborted, "goals_until_then": state["goals"]}
    state["way"] = "hold"
    wait(lambda: state["cancels"] > 0 and state["goals"] > 0, "the late goal is cancelled")

    run("hold")
    call(CancelGoal, f"{ACTION}/_action/cancel_goal", CancelGoal.Request())
    found["cancelled"] = fault("cancelled")

    run("hold")
    # The goal is not ended before, as little as by a table that loses its power.
    state["way"] = "gone"
    wait(lambda: state["asleep"], "the motion stands still")
    table.end_with(state["server"].destroy)
    found["gone"] = fault("gone")
    return found


state["server"] = server()
node.create_timer(0.02, tell_joints, callback_group=group)
node.create_subscription(
    SchemeStatus, "/scheme/status", lambda status: state["statuses"].append(status), reliable(10, latched=True), callback_group=group
)
for spinning in (table, observer):
    spinning.thread.start()
answer(runs())
# The goal of the table that is gone never ends, so neither would its thread.
sys.stdout.flush()
os._exit(0)
