"""Turns the table by one trajectory: move_table.py OUTER_RAD INNER_RAD

Publishes a JointTrajectory as a joint_trajectory_controller takes it, and answers with where the joints came to rest.
"""

import sys

import rclpy
from peer import answer, reliable, spin_until
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

target = [float(argument) for argument in sys.argv[1:3]]
names = ["outer_joint", "inner_joint"]
rclpy.init()
node = rclpy.create_node("mover")
publisher = node.create_publisher(JointTrajectory, "turntable/joint_trajectory", reliable(10))
newest = {}


def take(message):
    newest["position"] = [message.position[message.name.index(name)] for name in names]
    newest["velocity"] = [message.velocity[message.name.index(name)] for name in names]


node.create_subscription(JointState, "turntable/joint_states", take, reliable())
spin_until(node, lambda: newest and publisher.get_subscription_count() > 0, "a table that listens and reports")
start = newest["position"]

trajectory = JointTrajectory(joint_names=names)
for seconds, position in [(0, start), (2, target)]:
    point = JointTrajectoryPoint(positions=position, velocities=[0.0, 0.0])
    point.time_from_start.sec = seconds
    trajectory.points.append(point)
publisher.publish(trajectory)
spin_until(node, lambda: newest["velocity"] != [0.0, 0.0], "the table moves", 20.0)
spin_until(node, lambda: newest["velocity"] == [0.0, 0.0], "the table rests", 20.0)
answer({"start": start, "end": newest["position"]})
rclpy.shutdown()
