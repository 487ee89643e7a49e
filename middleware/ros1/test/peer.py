"""Programs of ROS 1 that are not ours, over rospy and rosbag: the other side of the tests.

peer.py echo TYPE TOPIC N            prints N messages, a line each, and the md5 of the type first
peer.py send TYPE TOPIC HZ EXPR      sends what EXPR makes of m and k, the number of the message, until it is ended
peer.py frames HZ EXPR               sends transforms: EXPR calls tf(parent, child, time, x, y, z, angle about z) and still(...) of the same for the time t, and k
peer.py transforms FILE              writes a bag of transforms: base in map 10 times a second, at x = 0, 1, ..., 9, the camera at rest in it
peer.py bag FILE COMPRESSION EXPR    writes a bag: EXPR calls write(topic, type, t, assignments to m)
peer.py index FILE                   prints what rosbag's own reader has: topic, time in ns, message
peer.py reindex FILE                 does what `rosbag reindex` does to a bag that was cut
peer.py md5 TYPE...                  prints the md5 of the types of messages or services, a line each
peer.py legal NAME...                prints of each whether rosgraph takes it as a name, and as that of a node
peer.py see TYPE TOPIC EXPR          prints what EXPR makes of the next message m
peer.py effort NAMESPACE KP KD N     drives a served robot to 0 by efforts, a command for each of N states, and prints their times and positions
peer.py path NAMESPACE JOINT X       sends a trajectory to X, and prints where the joint is when it is there
peer.py call NAME TYPE EXPR          calls a service with what EXPR makes of r, and prints the answer
peer.py offer NAME TYPE EXPR         offers a service that answers what EXPR makes of a, for the request r and its number k
peer.py kill NODE                    asks a node to end, as rosnode does
peer.py robot NAMESPACE JOINT...     is a robot: integrates commands of efforts (as accelerations) and velocities, takes positions
                                     and ways at once, tells its joints in the other order; prints "let go" at zeros after others
"""

import importlib.util
import itertools
import math
import queue
import sys
import time
import xmlrpc.client

import genpy.dynamic
import rosbag
import rosgraph.names
import rospy


def type_of(name, kinds=("msg",)):
    package, its = name.split("/")
    modules = [importlib.import_module(f"{package}.{kind}") for kind in kinds if importlib.util.find_spec(f"{package}.{kind}")]
    return next(getattr(module, its) for module in modules if hasattr(module, its))


def say(*words):
    """A line at once, as several threads speak."""
    print(" ".join(map(str, words)) + "\n", end="", flush=True)


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


def kill(node):
    xmlrpc.client.ServerProxy(rosgraph.Master("/peer").lookupNode(node)).shutdown("/peer", "user request")


def legal(*names):
    for name in names:
        say(int(rosgraph.names.is_legal_name(name)), int(rosgraph.names.is_legal_base_name(name)))


def transforms_type():
    """tf2_msgs/TFMessage, made by genpy, as its package need not be installed."""
    from geometry_msgs.msg import TransformStamped

    text = "geometry_msgs/TransformStamped[] transforms\n" + "=" * 80 + "\nMSG: geometry_msgs/TransformStamped\n"
    return genpy.dynamic.generate_dynamic("tf2_msgs/TFMessage", text + TransformStamped._full_text)["tf2_msgs/TFMessage"]


def transform(parent, child, t, x=0.0, y=0.0, z=0.0, angle=0.0):
    from geometry_msgs.msg import TransformStamped

    m = TransformStamped()
    m.header.frame_id, m.child_frame_id = parent, child
    m.header.stamp = rospy.Time(0, round(t * 1e9))
    m.transform.translation.x, m.transform.translation.y, m.transform.translation.z = x, y, z
    m.transform.rotation.z, m.transform.rotation.w = math.sin(angle / 2), math.cos(angle / 2)
    return m


def frames(rate, expression):
    rospy.init_node("peer", anonymous=True)
    its = transforms_type()
    moving = rospy.Publisher("/tf", its, queue_size=100)
    latched = rospy.Publisher("/tf_static", its, queue_size=100, latch=True)
    told = {}

    def tf(*words):
        moving.publish(its(transforms=[transform(*words)]))

    def still(parent, child, *words):
        if told.get(child) != words:
            told[child] = words
            latched.publish(its(transforms=[transform(parent, child, *words)]))

    say("ready")
    k = 0
    while True:
        exec(expression, {"tf": tf, "still": still, "t": time.time(), "k": k})
        k += 1
        time.sleep(1 / float(rate))


def transforms(path):
    its = transforms_type()
    with rosbag.Bag(path, "w") as to:
        for k in range(10):
            t = 1_600_000_000 + 0.1 * k
            if k == 2:
                to.write("/tf_static", its(transforms=[transform("base", "camera", 0.0, 0.0, 0.0, 1.0)]), rospy.Time(0, round(t * 1e9)))
            to.write("/tf", its(transforms=[transform("/map", "/base", t - 0.03, float(k))]), rospy.Time(0, round(t * 1e9)))
    say(its._md5sum)


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
        say(type_of(name, ("msg", "srv"))._md5sum)


def see(name, topic, expression):
    rospy.init_node("peer", anonymous=True)
    say(eval(expression, {"m": rospy.wait_for_message(topic, type_of(name), 30), "rospy": rospy}))


def listeners(publisher):
    while publisher.get_num_connections() == 0:
        time.sleep(0.01)


def effort(namespace, kp, kd, count):
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    rospy.init_node("peer", anonymous=True)
    publisher = rospy.Publisher(f"{namespace}/effort_controller/command", Float64MultiArray, queue_size=10)
    listeners(publisher)
    states = queue.Queue()
    rospy.Subscriber(f"{namespace}/joint_states", JointState, states.put, tcp_nodelay=True)
    say("ready")
    for _ in range(int(count)):
        state = states.get(timeout=30)
        publisher.publish(Float64MultiArray(data=[-float(kp) * q - float(kd) * v for q, v in zip(state.position, state.velocity)]))
        say(state.header.stamp.to_sec(), *state.position)
    time.sleep(0.2)  # until the last one is sent


def path(namespace, joint, target):
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rospy.init_node("peer", anonymous=True)
    publisher = rospy.Publisher(f"{namespace}/joint_trajectory_controller/command", JointTrajectory, queue_size=1)
    listeners(publisher)
    where = [0.0]
    rospy.Subscriber(f"{namespace}/joint_states", JointState, lambda m: where.append(dict(zip(m.name, m.position))[joint]))
    half = JointTrajectoryPoint(positions=[float(target) / 2], time_from_start=rospy.Duration(0.25))
    whole = JointTrajectoryPoint(positions=[float(target)], time_from_start=rospy.Duration(0.5))
    publisher.publish(JointTrajectory(joint_names=[joint], points=[half, whole]))
    end = time.time() + 20
    while time.time() < end and abs(where[-1] - float(target)) > 0.03:
        time.sleep(0.01)
    say(where[-1])


def call(name, kind, expression="None"):
    its = type_of(kind, ("srv",))
    rospy.init_node("peer", anonymous=True)
    rospy.wait_for_service(name, 20)
    r = its._request_class()
    exec(expression, {"r": r})
    say(str(rospy.ServiceProxy(name, its)(r)).replace("\n", " | "))


def offer(name, kind, expression):
    its = type_of(kind, ("srv",))
    rospy.init_node("peer", anonymous=True)
    count = itertools.count(1)

    def take(r):
        a = its._response_class()
        exec(expression, {"r": r, "a": a, "k": next(count), "time": time})
        return a

    rospy.Service(name, its, take)
    say("ready")
    while True:
        time.sleep(1)


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
