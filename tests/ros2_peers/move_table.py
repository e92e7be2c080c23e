"""Turns the table by one trajectory: move_table.py OUTER_RAD INNER_RAD

Publishes a JointTrajectory as a joint_trajectory_controller takes it, and answers with where the joints came to rest.
"""

import sys

import rclpy
from peer import answer, reliable, spin_until, trajectory, watch_joints
from trajectory_msgs.msg import JointTrajectory

target = [float(argument) for argument in sys.argv[1:3]]
rclpy.init()
node = rclpy.create_node("mover")
publisher = node.create_publisher(JointTrajectory, "turntable/joint_trajectory", reliable(10))
newest = watch_joints(node)
spin_until(node, lambda: newest and publisher.get_subscription_count() > 0, "a table that listens and reports")
start = newest["position"]
publisher.publish(trajectory(start, target, 2))
spin_until(node, lambda: newest["velocity"] != [0.0, 0.0], "the table moves")
spin_until(node, lambda: newest["velocity"] == [0.0, 0.0], "the table rests")
answer({"start": start, "end": newest["position"]})
rclpy.shutdown()
