"""Programs of ROS 2 that are not ours, over rclpy: the other side of the tests.

peer.py echo TYPE TOPIC N            prints N messages, a line each
peer.py send TYPE TOPIC HZ EXPR      sends what EXPR makes of m and k, the number of the message, until it is ended
peer.py effort NAMESPACE KP KD N     drives a served robot to 0 by efforts, a command for each of N states
peer.py answer NAMESPACE N LATE      answers N states by efforts, each that comes, a fifth of them LATE s late
peer.py path NAMESPACE JOINT X       sends a trajectory to X, and prints where the joint is until it is there
peer.py call NAME TYPE EXPR          calls a service with what EXPR makes of r, and prints the answer
peer.py offer NAME TYPE EXPR         offers a service that answers what EXPR makes of a, for the request r and its number k
peer.py parameters NODE EXPR...      prints what a client c of the node's parameters answers to each EXPR, a line each; P(name, value)
"""

import importlib
import sys
import time

import rclpy
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

rclpy.init()
node = rclpy.create_node("peer")


def type_of(name):
    package, kind, its = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), its)


def say(*words):
    print(*words, flush=True)


def echo(name, topic, count):
    left = int(count)

    def take(message):
        nonlocal left
        say(message)
        left -= 1

    node.create_subscription(type_of(name), topic, take, qos_profile_sensor_data)
    say("ready")
    while left > 0:
        rclpy.spin_once(node)


def send(name, topic, rate, expression):
    its = type_of(name)
    publisher = node.create_publisher(its, topic, QoSProfile(depth=10))
    say("ready")
    k = 0
    while True:
        m = its()
        exec(expression, {"m": m, "k": k})
        publisher.publish(m)
        k += 1
        time.sleep(1 / float(rate))


def effort(namespace, kp, kd, count):
    publisher = node.create_publisher(Float64MultiArray, f"{namespace}/effort_controller/commands", 10)
    states = []
    node.create_subscription(JointState, f"{namespace}/joint_states", states.append, 10)
    while publisher.get_subscription_count() == 0:
        rclpy.spin_once(node, timeout_sec=0.05)
    say("ready")
    last = None
    left = int(count)
    while left > 0:
        while not states:
            rclpy.spin_once(node)
        state = states[-1]
        states.clear()
        time_of = (state.header.stamp.sec, state.header.stamp.nanosec)
        if time_of == last:
            continue
        last = time_of
        left -= 1
        torques = [-float(kp) * q - float(kd) * v for q, v in zip(state.position, state.velocity)]
        publisher.publish(Float64MultiArray(data=torques))
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
    {f.__name__: f for f in (echo, send, effort, answer, path, call, offer, parameters)}[sys.argv[1]](*sys.argv[2:])
except KeyboardInterrupt:
    pass
