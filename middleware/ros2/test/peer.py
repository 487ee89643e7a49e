"""Programs of ROS 2 that are not ours, over rclpy: the other side of the tests.

peer.py echo TYPE TOPIC N            prints N messages, a line each
peer.py follow TYPE TOPIC N          the same once somebody sends to the topic, who soon knows this program then
peer.py hear TYPE TOPIC N            the same of what is sent reliably, of which none is lost
peer.py latched TYPE TOPIC N         the same of a topic whose messages stay for those who come later
peer.py send TYPE TOPIC HZ EXPR [N]  keeps N messages on their way, and sends what EXPR makes of m and k, the number of the message, until it is ended
peer.py frames HZ EXPR               sends transforms: EXPR calls tf(parent, child, time, x, y, z, angle about z) and still(...) of the same for the time t, and k
peer.py effort NAMESPACE KP KD N     drives a served robot to 0 by efforts, a command for each of N states
peer.py answer NAMESPACE N LATE      answers N states by efforts, each that comes, a fifth of them LATE s late
peer.py path NAMESPACE JOINT X       sends a trajectory to X, and prints where the joint is until it is there
peer.py call NAME TYPE EXPR          calls a service with what EXPR makes of r, and prints the answer
peer.py offer NAME TYPE EXPR         offers a service that answers what EXPR makes of a, for the request r and its number k
peer.py camera TOPIC                 prints what a camera shows: its time, heads of its messages, and how its points agree with its depths
peer.py pursue NAME TYPE CODE        serves an action: CODE handles each goal g by its handle h, feedback f and result r; prints what it does
peer.py parameters NODE EXPR...      prints what a client c of the node's parameters answers to each EXPR, a line each; P(name, value)
"""

import importlib
import sys
import time

import numpy as np
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

rclpy.init()
node = rclpy.create_node("peer")


def type_of(name):
    package, kind, its = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), its)


def say(*words):
    """A line at once, as several threads speak."""
    print(" ".join(map(str, words)) + "\n", end="", flush=True)


def echo(name, topic, count, profile=qos_profile_sensor_data):
    left = int(count)

    def take(message):
        nonlocal left
        say(message)
        left -= 1

    node.create_subscription(type_of(name), topic, take, profile)
    say("ready")
    while left > 0:
        rclpy.spin_once(node)


def follow(name, topic, count):
    while node.count_publishers(topic) == 0:
        rclpy.spin_once(node, timeout_sec=0.05)
    echo(name, topic, count)


def hear(name, topic, count):
    echo(name, topic, count, QoSProfile(depth=1000))


def latched(name, topic, count):
    echo(name, topic, count, QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL))


def send(name, topic, rate, expression, depth="10"):
    its = type_of(name)
    publisher = node.create_publisher(its, topic, QoSProfile(depth=int(depth)))
    say("ready")
    k = 0
    while True:
        m = its()
        exec(expression, {"m": m, "k": k})
        publisher.publish(m)
        k += 1
        time.sleep(1 / float(rate))


def frames(rate, expression):
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage

    moving = node.create_publisher(TFMessage, "/tf", 100)
    latched = node.create_publisher(TFMessage, "/tf_static", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    told = {}

    def transform(parent, child, t, x=0.0, y=0.0, z=0.0, angle=0.0):
        m = TransformStamped(child_frame_id=child)
        m.header.frame_id = parent
        m.header.stamp.sec, m.header.stamp.nanosec = divmod(round(t * 1e9), 10**9)
        m.transform.translation.x, m.transform.translation.y, m.transform.translation.z = map(float, (x, y, z))
        m.transform.rotation.z, m.transform.rotation.w = float(np.sin(angle / 2)), float(np.cos(angle / 2))
        return m

    def tf(*words):
        moving.publish(TFMessage(transforms=[transform(*words)]))

    def still(parent, child, *words):
        new = transform(parent, child, *words)
        if told.get(child) != words:
            told[child] = words
            latched.publish(TFMessage(transforms=[new]))

    say("ready")
    k = 0
    while True:
        exec(expression, {"tf": tf, "still": still, "t": time.time(), "k": k})
        k += 1
        time.sleep(1 / float(rate))


def effort(namespace, kp, kd, count):
    publisher = node.create_publisher(Float64MultiArray, f"{namespace}/effort_controller/commands", 10)
    states = []
    node.create_subscription(JointState, f"{namespace}/joint_states", states.append, 10)
    while publisher.get_subscription_count() == 0:
        rclpy.spin_once(node, timeout_sec=0.05)
    say("ready")
    last = command = None
    left = int(count)
    while left > 0:
        silent_from = time.monotonic()
        while not states:
            rclpy.spin_once(node, timeout_sec=0.5)
            # Who is found may find the finder later; what is said between is lost.
            if not states and command and time.monotonic() - silent_from > 5:
                publisher.publish(command)
                silent_from = time.monotonic()
        state = states[-1]
        states.clear()
        time_of = (state.header.stamp.sec, state.header.stamp.nanosec)
        if time_of == last:
            continue
        last = time_of
        left -= 1
        torques = [-float(kp) * q - float(kd) * v for q, v in zip(state.position, state.velocity)]
        command = Float64MultiArray(data=torques)
        publisher.publish(command)
        say(time_of[0] + 1e-9 * time_of[1], *state.position)


def answer(namespace, count, late):
    publisher = node.create_publisher(Float64MultiArray, f"{namespace}/effort_controller/commands", 10)
    while publisher.get_subscription_count() == 0:
        rclpy.spin_once(node, timeout_sec=0.05)
    left = int(count)

    def take(state):
        nonlocal left
        if left % 5 == 0:
            time.sleep(float(late))
        left -= 1
        publisher.publish(Float64MultiArray(data=[-20 * (q - 0.1) - v for q, v in zip(state.position, state.velocity)]))
        say(state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec, *state.position)

    node.create_subscription(JointState, f"{namespace}/joint_states", take, 10)
    say("ready")
    while left > 0:
        rclpy.spin_once(node)


def path(namespace, joint, target):
    publisher = node.create_publisher(JointTrajectory, f"{namespace}/joint_trajectory_controller/joint_trajectory", 10)
    states = []
    node.create_subscription(JointState, f"{namespace}/joint_states", states.append, 10)
    while publisher.get_subscription_count() == 0 or not states:
        rclpy.spin_once(node, timeout_sec=0.05)
    message = JointTrajectory(joint_names=[joint])
    point = JointTrajectoryPoint(positions=[float(target)], velocities=[0.0])
    point.time_from_start.nanosec = 500_000_000
    message.points = [point]
    publisher.publish(message)
    end = time.time() + 20
    while time.time() < end:
        rclpy.spin_once(node)
        its = dict(zip(states[-1].name, states[-1].position))[joint]
        states[:] = states[-1:]
        if abs(its - float(target)) < 0.03:
            break
    say(its)


def call(name, kind, expression="None"):
    client = node.create_client(type_of(kind), name)
    if not client.wait_for_service(timeout_sec=10):
        sys.exit("no service")
    r = type_of(kind).Request()
    exec(expression, {"r": r})
    answer = client.call_async(r)
    rclpy.spin_until_future_complete(node, answer, timeout_sec=10)
    say(answer.result())


def offer(name, kind, expression):
    k = 0

    def take(r, a):
        nonlocal k
        k += 1
        exec(expression, {"r": r, "a": a, "k": k})
        return a

    node.create_service(type_of(kind), name, take)
    say("ready")
    rclpy.spin(node)


def camera(topic):
    of = {}

    def listen(kind, its):
        def take(message):
            of.setdefault((message.header.stamp.sec, message.header.stamp.nanosec), {})[its] = message

        node.create_subscription(kind, f"{topic}/{its}", take, 10)

    for kind, its in ((Image, "image_raw"), (Image, "depth/image_raw"), (PointCloud2, "points"), (CameraInfo, "camera_info")):
        listen(kind, its)
    say("ready")
    while not (whole := [(time, its) for time, its in of.items() if len(its) == 4]):
        rclpy.spin_once(node)
    (seconds, nanoseconds), its = whole[0]
    say(seconds + 1e-9 * nanoseconds)
    image, depth, cloud, info = (its[name] for name in ("image_raw", "depth/image_raw", "points", "camera_info"))
    for m in (image, depth):
        say(m.encoding, m.height, m.width, m.step, m.is_bigendian, m.header.frame_id, len(m.data))
    say(*(f"{f.name}:{f.offset}:{f.datatype}:{f.count}" for f in cloud.fields), cloud.height, cloud.width, cloud.point_step)
    say(cloud.row_step, cloud.is_dense, cloud.header.frame_id, len(cloud.data))
    say(info.distortion_model, list(info.d), info.height, info.width, info.header.frame_id)
    rgb = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)
    z = np.frombuffer(bytes(depth.data), np.float32).reshape(depth.height, depth.width)
    points = np.frombuffer(bytes(cloud.data), np.dtype([("xyz", "<f4", 3), ("bgr0", "u1", 4)])).reshape(z.shape)
    near = np.isfinite(z)
    v, u = np.mgrid[: z.shape[0], : z.shape[1]]
    k = np.array(info.k).reshape(3, 3)
    # Each point is on the ray of its pixel, at its depth.
    rays = np.linalg.solve(k, np.stack([u, v, np.ones_like(u)]).reshape(3, -1).astype(float)).T.reshape(*z.shape, 3)
    error = np.abs(points["xyz"] - rays * z[..., None])[near].max()
    colours = (points["bgr0"][..., 2::-1] == rgb).all()
    say(error, bool(colours), bool(np.isnan(points["xyz"][~near]).all()), int((~near).sum()))
    say(k[0, 0], k[0, 2], k[1, 1], k[1, 2], np.allclose(np.array(info.p).reshape(3, 4)[:, :3], k))
    say(z.dtype, z[50, 80], *rgb[50, 80], z[0, 0], *rgb[0, 0])
    box = rgb[..., 0] > rgb[..., 1]
    say(*np.argwhere(box).min(0), *np.argwhere(box).max(0))


def pursue(name, kind, code):
    its = type_of(kind)

    def take(g):
        say("goal", g.target, list(g.weights), g.frame)
        return GoalResponse.ACCEPT if g.target >= 0 else GoalResponse.REJECT

    def cancel(_):
        say("cancel")
        return CancelResponse.ACCEPT

    def execute(h):
        f, r = its.Feedback(), its.Result()
        exec(code, {"g": h.request, "h": h, "f": f, "r": r, "time": time, "say": say})
        return r

    group = ReentrantCallbackGroup()
    _server = ActionServer(node, its, name, execute, goal_callback=take, cancel_callback=cancel, callback_group=group)
    say("ready")
    rclpy.spin(node, MultiThreadedExecutor(4))


def parameters(name, *expressions):
    def make(key, value):
        return Parameter(key, value=value)

    client = AsyncParameterClient(node, name)
    if not client.wait_for_services(timeout_sec=20):
        sys.exit("no node")
    for expression in expressions:
        answer = eval(expression, {"c": client, "P": make})
        rclpy.spin_until_future_complete(node, answer, timeout_sec=10)
        say(answer.result())


try:
    {f.__name__: f for f in (echo, follow, hear, latched, send, frames, effort, answer, path, call, offer, camera, pursue, parameters)}[sys.argv[1]](*sys.argv[2:])
except KeyboardInterrupt:
    pass
