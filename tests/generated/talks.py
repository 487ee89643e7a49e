"""A generated program with blocks of ROS 2 beside programs of rclpy: talks.py PROGRAM PYTHON PEER."""
import csv
import ctypes
import fcntl
import math
import os
import socket
import struct
import subprocess
import sys
import tempfile

program, python, peer = sys.argv[1:]
if ctypes.CDLL(None).unshare(0x40000000) != 0:  # a network of its own
    print("this system gives a program no network of its own")
    sys.exit(77)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
    fcntl.ioctl(any_socket, 0x8914, struct.pack("16sh14x", b"lo", 0x41))
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def start(*words):
    its = subprocess.Popen([python, peer, *words], stdout=subprocess.PIPE, text=True)
    assert its.stdout.readline() == "ready\n"
    return its


sends = start("send", "std_msgs/msg/Float64", "/constant", "100", "m.data=42.5")
hears = start("echo", "std_msgs/msg/Float64", "/wave", "20")
with tempfile.TemporaryDirectory() as folder:
    path = f"{folder}/run.csv"
    ran = subprocess.Popen([program, "--stop", "20", "--realtime", "--priority", "0", "--watchdog", "0", "--csv", path])
    heard = [float(hears.stdout.readline().split("data=")[1].rstrip(")\n")) for _ in range(20)]
    ran.terminate()
    ran.wait(20)
    sends.kill()
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
waves = [math.sin(6 * 0.01 * k) for k in range(2001)]
assert all(min(abs(value - wave) for wave in waves) < 1e-12 for value in heard), heard
assert len(set(heard)) > 10, heard
assert rows and {float(row["in.data"]) for row in rows} == {42.5}
