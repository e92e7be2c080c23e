"""Takes samples of an IMU from whoever offers them: hear.py TOPIC COUNT SECONDS

Answers with how many came in that time, at most COUNT.
"""

import sys
import time

import rclpy
from peer import answer
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

topic, count, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
rclpy.init()
node = rclpy.create_node("listener")
received = []
node.create_subscription(Imu, topic, received.append, qos_profile_sensor_data)
end = time.monotonic() + seconds
while len(received) < count and time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
answer({"received": len(received)})
rclpy.shutdown()
