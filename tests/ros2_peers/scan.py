"""Publishes a message of a type that the suite does not have: scan.py SUBSCRIBERS

Says so when that many subscribers of /scan have it.
"""

import sys

import rclpy
from peer import GUARD, filled, reliable, spin_until
from rclpy.duration import Duration
from sensor_msgs.msg import LaserScan

rclpy.init()
node = rclpy.create_node("lidar")
publisher = node.create_publisher(LaserScan, "/scan", reliable())
spin_until(node, lambda: publisher.get_subscription_count() == int(sys.argv[1]), "subscribers of /scan")
publisher.publish(filled(LaserScan))
if not publisher.wait_for_all_acked(Duration(seconds=GUARD)):
    sys.exit("the scan is not acknowledged")
print("the scan has arrived", flush=True)
rclpy.spin(node)
