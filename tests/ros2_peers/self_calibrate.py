"""Asks the calibrator for its action, in every way it can end: self_calibrate.py [silent | cleanup]

With `silent` only for one more goal, whose samples do not come; with `cleanup` for one in the midst of which the node is
deactivated and cleaned up.
"""

import math
import sys

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from peer import answer, call, plain, reliable, spin_until
from rclpy.action import ActionClient
from rotary_sins_msgs.action import SelfCalibrate
from rotary_sins_msgs.msg import SchemeStatus, SelfCalibrationEstimate

DEG = math.pi / 180.0
# Wide enough to be reached soon after the first turn.
WIDE = {
    "azimuth_threshold": 20.0 * DEG,
    "level_threshold": DEG,
    "gyroscope_drift_threshold": 1.0 * DEG / 3600.0,
    "accelerometer_bias_threshold": 0.1,
}

rclpy.init()
node = rclpy.create_node("asker")
# Feedback comes forty times a second; what waits while this process stands still is kept.
client = ActionClient(node, SelfCalibrate, "/self_calibrator/self_calibrate", feedback_sub_qos_profile=reliable())
seen = {}
node.create_subscription(
    SelfCalibrationEstimate, "/self_calibration/estimate", lambda m: seen.update(estimate=m), reliable(latched=True)
)
node.create_subscription(SchemeStatus, "/scheme/status", lambda m: seen.update(scheme=m), reliable(latched=True))
spin_until(node, client.server_is_ready, "the calibrator")
spin_until(node, lambda: len(seen) == 2, "estimate and scheme")


def wait(future, what):
    spin_until(node, future.done, what)
    return future.result()


class Asked:
    def __init__(self, **fields):
        self.feedback = []
        call = client.send_goal_async(
            SelfCalibrate.Goal(**fields), feedback_callback=lambda m: self.feedback.append(plain(m.feedback))
        )
        self.handle = wait(call, "an answer to the goal")

    def hear(self, is_it, what):
        """Spins until a feedback is as it is waited for."""
        spin_until(node, lambda: any(is_it(feedback) for feedback in self.feedback), what)

    def end(self, last):
        """The result, which is asked for once the feedback that is the last has been heard: rclpy drops what comes later."""
        self.hear(last, "the last feedback")
        return self.result()

    def result(self):
        response = wait(self.handle.get_result_async(), "a result")
        return {"status": response.status, "result": plain(response.result), "feedback": self.feedback}


def stamp(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


if sys.argv[1:] == ["silent"]:
    answer(Asked(time_limit=1000.0).result())
    sys.exit()
if sys.argv[1:] == ["cleanup"]:
    running = Asked(azimuth_threshold=1e-9)
    running.hear(lambda feedback: True, "feedback")
    end = running.handle.get_result_async()
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP):
        request = ChangeState.Request(transition=Transition(id=transition))
        if not call(node, ChangeState, "/self_calibrator/change_state", request).success:
            sys.exit(f"transition {transition} is refused")
    response = wait(end, "a result")
    answer({"status": response.status, "result": plain(response.result)})
    sys.exit()
found = {
    "nonsense": Asked(time_limit=-1.0).handle.accepted,
    "negative": Asked(gyroscope_drift_threshold=-1e-8).handle.accepted,
    "not a number": Asked(azimuth_threshold=math.nan).handle.accepted,
}
# Once one feedback has come, the server knows this client's reader, and none is lost from its first one on.
matched = Asked(azimuth_threshold=1e-9)
matched.hear(lambda feedback: True, "feedback")
wait(matched.handle.cancel_goal_async(), "an answer to the cancel")
matched.result()
first = Asked(restart=True, time_limit=90.0, azimuth_threshold=1e-9)
found["second"] = Asked().handle.accepted
found["time limit"] = first.end(lambda feedback: feedback["elapsed"] >= 90.0)
found["wrong scheme"] = Asked(scheme="static").result()
found["converged"] = Asked(scheme=seen["scheme"].scheme, **WIDE).end(lambda feedback: feedback["phase_name"] == "converged")
running = Asked(azimuth_threshold=1e-9)
running.hear(lambda feedback: True, "feedback")
code = wait(running.handle.cancel_goal_async(), "an answer to the cancel").return_code
found["cancelled"] = running.result() | {"code": code}
before = stamp(seen["estimate"])
spin_until(node, lambda: stamp(seen["estimate"]) > before + 5.0, "the calibrator goes on")
found["after"] = {"duration": seen["estimate"].duration, "phase": seen["estimate"].phase_name}
# By the parameters alone it had not converged: what a goal asked for is over with it.
answer(found)
rclpy.shutdown()
