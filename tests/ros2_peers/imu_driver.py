"""A driver of an IMU that never says a word: two nodes of one process, of which one has the best-effort publisher."""

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

rclpy.init()
quiet = rclpy.create_node("quiet", namespace="/ship")
driver = rclpy.create_node("imu_driver", namespace="/ship")
publisher = driver.create_publisher(Imu, "/imu/data_raw", qos_profile_sensor_data)
executor = SingleThreadedExecutor()
executor.add_node(quiet)
executor.add_node(driver)
executor.spin()
