"""Writes a recording as other programs do: messages of ROS 2 and of JSON. Run as: write_foreign.py FILE."""
import json
import math
import sys

from mcap.writer import CompressionType, Writer
from mcap_ros2.writer import Writer as RosWriter

START = 1_700_000_000_000_000_000
HEADER = """std_msgs/Header header
%s
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
JOINTS = HEADER % "string[] name\nfloat64[] position\nfloat64[] velocity"
IMU = HEADER % "geometry_msgs/Quaternion orientation\nfloat64[9] angular_velocity_covariance" + """
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""

with open(sys.argv[1], "wb") as stream:
    ros = RosWriter(stream, compression=CompressionType.NONE)
    joints = ros.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
    imu = ros.register_msgdef("sensor_msgs/msg/Imu", IMU)
    writer = ros._writer  # the same file holds JSON
    battery = writer.register_channel("/battery", "json", writer.register_schema("battery", "jsonschema", b"{}"))
    for k in range(50):
        t, now = k / 10, START + k * 100_000_000
        header = {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": "base"}
        ros.write_message("/joint_states", joints, {"header": header, "name": ["a", "b", "c"], "velocity": [],
                                                    "position": [t, math.sin(t), math.cos(t)]}, now, now)
        ros.write_message("/imu", imu, {"header": header, "angular_velocity_covariance": [0.5] * 9,
                                        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1 - t}}, now, now)
        writer.add_message(battery, now, json.dumps({"cell": {"volts": 12 - t}, "name": "main"}).encode(), now)
    ros.finish()
