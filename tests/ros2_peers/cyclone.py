"""Reads imu/data_raw with Cyclone DDS, the second DDS vendor: cyclone.py COUNT

No ROS in here: the names and types are those that ROS 2 gives on the wire. Answers with the last message's numbers.
"""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


wanted = int(sys.argv[1])
participant = DomainParticipant(0)
qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000))
reader = DataReader(participant, Topic(participant, "rt/imu/data_raw", Imu), qos=qos)
stamps = []
# Only ends what would never end.
end = time.monotonic() + 600.0
while len(stamps) < wanted:
    if time.monotonic() > end:
        sys.exit(f"{len(stamps)} of {wanted} messages after 60 s")
    for message in reader.take(100):
        stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)
        last = message
    time.sleep(0.01)
print(
    json.dumps(
        {
            "frame_id": last.header.frame_id,
            "linear_acceleration_z": last.linear_acceleration.z,
            "intervals_ns": sorted({later - earlier for earlier, later in zip(stamps, stamps[1:])}),
        }
    )
)
