"""Programs of ROS 1 that are not ours, over rospy and rosbag: the other side of the tests.

peer.py echo TYPE TOPIC N            prints N messages, a line each, and the md5 of the type first
peer.py send TYPE TOPIC HZ EXPR      sends what EXPR makes of m and k, the number of the message, until it is ended
peer.py bag FILE COMPRESSION EXPR    writes a bag: EXPR calls write(topic, type, t, assignments to m)
peer.py index FILE                   prints what rosbag's own reader has: topic, time in ns, message
peer.py md5 TYPE...                  prints the md5 of the types, a line each
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


def md5(*names):
    for name in names:
        say(type_of(name)._md5sum)


globals()[sys.argv[1]](*sys.argv[2:])
