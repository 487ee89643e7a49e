"""Programs of ROS 1 that are not ours, over rospy and rosbag: the other side of the tests.

peer.py echo TYPE TOPIC N            prints N messages, a line each, and the md5 of the type first
peer.py send TYPE TOPIC HZ EXPR      sends what EXPR makes of m and k, the number of the message, until it is ended
peer.py bag FILE COMPRESSION EXPR    writes a bag: EXPR calls write(topic, type, t, assignments to m)
peer.py index FILE                   prints what rosbag's own reader has: topic, time in ns, message
peer.py reindex FILE                 does what `rosbag reindex` does to a bag that was cut
peer.py md5 TYPE...                  prints the md5 of the types, a line each
peer.py robot NAMESPACE JOINT...     is a robot: integrates commands of efforts (as accelerations) and velocities, takes positions
                                     and ways at once, tells its joints in the other order; prints "let go" at zeros after others
"""

import importlib
import sys
import time

import rosbag
import rospy


def type_of(name):
    package, its = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), its)


def say(*words):
    print(*words, flush=True)


def echo(name, topic, count):
    rospy.init_node("peer", anonymous=True)
    left = [int(count)]

    def take(message):
        if left[0] > 0:
            say(str(message).replace("\n", " | "))
        left[0] -= 1

    rospy.Subscriber(topic, type_of(name), take, queue_size=100)
    say("ready")
    while left[0] > 0:
        time.sleep(0.005)


def send(name, topic, rate, expression):
    rospy.init_node("peer", anonymous=True)
    its = type_of(name)
    publisher = rospy.Publisher(topic, its, queue_size=10)
    say("ready")
    k = 0
    while True:
        m = its()
        exec(expression, {"m": m, "k": k, "rospy": rospy})
        publisher.publish(m)
        k += 1
        time.sleep(1 / float(rate))


def bag(path, compression, expression):
    with rosbag.Bag(path, "w", compression=compression, chunk_threshold=2000) as its:

        def write(topic, name, t, assignments):
            m = type_of(name)()
            exec(assignments, {"m": m, "t": t, "rospy": rospy})
            its.write(topic, m, rospy.Time.from_sec(0) + rospy.Duration.from_sec(1_600_000_000) + rospy.Duration(int(t), round((t % 1) * 1e9)))

        exec(expression, {"write": write})
    say("written")


def index(path):
    for topic, message, t in rosbag.Bag(path).read_messages():
        say(topic, t.to_nsec(), str(message).replace("\n", " | "))


def reindex(path):
    with rosbag.Bag(path, "a", allow_unindexed=True) as its:
        for _ in its.reindex():
            pass
    say("reindexed")


def md5(*names):
    for name in names:
        say(type_of(name)._md5sum)


def robot(namespace, *joints):
    from geometry_msgs.msg import WrenchStamped
    from sensor_msgs.msg import Imu, JointState
    from std_msgs.msg import Float64MultiArray
    from trajectory_msgs.msg import JointTrajectory

    rospy.init_node("robot", anonymous=True)
    n, dt = len(joints), 0.002
    s, v, effort = [0.0] * n, [0.0] * n, [0.0] * n
    was_driven = [False]

    def take(kind, values):
        if kind != "position" and not any(values) and was_driven[0]:
            say("let go")
        was_driven[0] = any(values)
        if kind == "effort":
            effort[:] = values
        elif kind == "velocity":
            v[:], effort[:] = values, [0.0] * n
        else:
            s[:], v[:], effort[:] = values, [0.0] * n, [0.0] * n

    for kind in ("effort", "velocity", "position"):
        rospy.Subscriber(f"{namespace}/{kind}_controller/command", Float64MultiArray, lambda m, kind=kind: take(kind, m.data))

    def follow(message):
        point = message.points[0]
        assert len(message.points) == 1 and tuple(message.joint_names) == joints, message
        say("way", point.time_from_start.to_sec())
        s[:], v[:] = point.positions, [0.0] * n

    rospy.Subscriber(f"{namespace}/joint_trajectory_controller/command", JointTrajectory, follow)
    states = rospy.Publisher(f"{namespace}/joint_states", JointState, queue_size=1)
    wrench = rospy.Publisher(f"{namespace}/foot", WrenchStamped, queue_size=1)
    imu = rospy.Publisher(f"{namespace}/imu", Imu, queue_size=1)
    say("ready")
    k = 0
    while True:
        for i in range(n):
            v[i] += effort[i] * dt
            s[i] += v[i] * dt
        m = JointState(name=joints[::-1], position=s[::-1], velocity=v[::-1], effort=effort[::-1])
        m.header.stamp = rospy.Time(k // 500, k % 500 * 2_000_000)
        states.publish(m)
        w = WrenchStamped()
        w.wrench.force.z, w.wrench.torque.x = 300.0, 2.0
        wrench.publish(w)
        a = Imu()
        a.orientation.z, a.orientation.w = 0.5**0.5, 0.5**0.5
        a.linear_acceleration.z, a.angular_velocity.y = 9.81, -1.0
        imu.publish(a)
        k += 1
        time.sleep(dt)


globals()[sys.argv[1]](*sys.argv[2:])
