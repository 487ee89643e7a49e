"""Writes a recording as other programs do: messages of ROS 2 and 1, Protocol Buffers and JSON, with chunks that are
compressed as named (NONE, LZ4, ZSTD). Run as: write_foreign.py FILE COMPRESSION."""
import json
import math
import struct
import sys

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as F
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

ROS1 = """Header header
int8 CODE=-3
byte code
time begin
duration lasting
float64[] effort
uint16[3] counts
Part[] parts
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: arm_msgs/Part
string name
int64 id
"""


def in_ros1(k):
    text = b"base"
    header = struct.pack("<III", k, 7, 8) + struct.pack("<I", len(text)) + text
    parts = struct.pack("<I", 2) + b"".join(struct.pack("<I", 1) + b"a" + struct.pack("<q", i - k) for i in (1, -2**40))
    return (header + struct.pack("<bIIii", -3, 5, 6, -1, 9) + struct.pack("<I2d", 2, k / 4, -k) + struct.pack("<3H", 1, 2, k)
            + parts)


def protobuf_class(syntax):
    """A message with a field of each type, and what holds it."""
    file = descriptor_pb2.FileDescriptorProto(name=f"{syntax}.proto", package=f"lab.{syntax}", syntax=syntax)
    arm = file.message_type.add(name="Arm")
    inner = arm.nested_type.add(name="Joint")
    inner.field.add(name="angle", number=1, type=F.TYPE_DOUBLE, label=F.LABEL_OPTIONAL)
    inner.field.add(name="inner", number=2, type=F.TYPE_MESSAGE, type_name=f".lab.{syntax}.Arm.Joint", label=F.LABEL_OPTIONAL)
    file.enum_type.add(name="Mode").value.add(name="off", number=0)
    file.enum_type[0].value.add(name="on", number=5)
    for number, name in enumerate(("double", "float", "int64", "uint64", "int32", "fixed64", "fixed32", "bool", "uint32",
                                   "sfixed32", "sfixed64", "sint32", "sint64"), 1):
        kind = getattr(F, f"TYPE_{name.upper()}")
        arm.field.add(name=f"one_{name}", number=number, type=kind, label=F.LABEL_OPTIONAL)
        row = arm.field.add(name=f"row_{name}", number=20 + number, type=kind, label=F.LABEL_REPEATED)
        row.options.packed = number % 2 == 0
    arm.field.add(name="mode", number=40, type=F.TYPE_ENUM, type_name=f".lab.{syntax}.Mode", label=F.LABEL_OPTIONAL)
    arm.field.add(name="label", number=41, type=F.TYPE_STRING, label=F.LABEL_OPTIONAL)
    arm.field.add(name="joint", number=42, type=F.TYPE_MESSAGE, type_name=f".lab.{syntax}.Arm.Joint", label=F.LABEL_OPTIONAL)
    arm.field.add(name="joints", number=1000, type=F.TYPE_MESSAGE, type_name=f".lab.{syntax}.Arm.Joint", label=F.LABEL_REPEATED)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    schema = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"lab.{syntax}.Arm")), schema


def arm_of(arm_class, k):
    arm = arm_class(one_double=k / 8, one_float=-0.5, one_int64=-2**50, one_uint64=2**50, one_int32=-k, one_fixed64=3, one_fixed32=4,
                    one_bool=k % 2, one_uint32=2**31, one_sfixed32=-5, one_sfixed64=-6, one_sint32=-7, one_sint64=-8, mode=5,
                    label="left")
    for kind in ("double", "float"):
        getattr(arm, f"row_{kind}").extend([0.25, -k, 1e6])
    for kind in ("int64", "int32", "sfixed32", "sfixed64", "sint32", "sint64"):
        getattr(arm, f"row_{kind}").extend([-1, k, 300])
    for kind in ("uint64", "fixed64", "fixed32", "uint32"):
        getattr(arm, f"row_{kind}").extend([1, k, 300])
    arm.row_bool.extend([True, False, True])
    arm.joint.inner.inner.angle = k
    for angle in (1, 2):
        arm.joints.add(angle=angle * k)
    return arm


with open(sys.argv[1], "wb") as stream:
    ros = RosWriter(stream, compression=CompressionType[sys.argv[2]], chunk_size=4096)
    joints = ros.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
    imu = ros.register_msgdef("sensor_msgs/msg/Imu", IMU)
    writer = ros._writer  # the same file holds JSON
    battery = writer.register_channel("/battery", "json", writer.register_schema("battery", "jsonschema", b"{}"))
    old = writer.register_channel("/old", "ros1", writer.register_schema("arm_msgs/Arm", "ros1msg", ROS1.encode()))
    arms = {}
    for syntax in ("proto2", "proto3"):
        arm_class, schema = protobuf_class(syntax)
        arms[arm_class] = writer.register_channel(
            f"/{syntax}", "protobuf", writer.register_schema(f"lab.{syntax}.Arm", "protobuf", schema))
    for k in range(50):
        t, now = k / 10, START + k * 100_000_000
        header = {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": "base"}
        ros.write_message("/joint_states", joints, {"header": header, "name": ["a", "b", "c"], "velocity": [],
                                                    "position": [t, math.sin(t), math.cos(t)]}, now, now)
        ros.write_message("/imu", imu, {"header": header, "angular_velocity_covariance": [0.5] * 9,
                                        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1 - t}}, now, now)
        writer.add_message(battery, now, json.dumps({"cell": {"volts": 12 - t}, "name": "main"}).encode(), now)
        writer.add_message(old, now, in_ros1(k), now)
        for arm_class, channel in arms.items():
            writer.add_message(channel, now, arm_of(arm_class, k).SerializeToString(), now)
    ros.finish()
