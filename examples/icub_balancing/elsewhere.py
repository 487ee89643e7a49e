"""The balancing diagram on its world directly and through middlewares, and all trajectories in one picture.

Usage: elsewhere.py BF [--deploy] [--yarp PREFIX] [--seconds S] [-o FOLDER]

Each way serves the world as a robot and lets the same diagram drive it, once step by step, where all numbers must be
those of the direct run (behind YARP, whose angles are degrees, but for roundoff), and once by the clock. Then the
controller is killed, and the robot must go on standing; and a run is replayed without the robot. With --deploy a package
of bf deploy drives it instead, step by step, with an empty environment and, where the system lets it, without what is
installed here. FOLDER (elsewhere) gets recordings and elsewhere.svg. Exit code 1 when something differs.
"""
import argparse
import atexit
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

here = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(here.parent))
import alone
import recorded

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bf", type=pathlib.Path)
parser.add_argument("--deploy", action="store_true", help="packages drive the robot")
parser.add_argument("--yarp", type=pathlib.Path, default=here.parents[1] / ".deps/yarp/prefix",
                    help="where YARP's programs are; without them, or without the plugin Yarp, it is left out")
parser.add_argument("--seconds", type=float, default=20)
parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("elsewhere"))
options = parser.parse_args()
bf, model, out = options.bf.resolve(), here / "balancing.yaml", options.output.resolve()
out.mkdir(parents=True, exist_ok=True)
seconds = repr(options.seconds)
name = f"icub-{os.getpid()}"
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:  # a port that nobody has
    probe.bind(("127.0.0.1", 0))
    port = str(probe.getsockname()[1])

doctor = json.loads(subprocess.run([bf, "doctor", "--json"], capture_output=True, text=True).stdout)
plugins = {m["plugin"] for m in doctor["middlewares"] if m["good"]} & {"Yarp", "Ros2"}
if plugins and not alone.enter_network_of_our_own():
    plugins = set()


ways = {"shared_memory": ["--shm", name], "udp": ["--udp", port, "--key", out / "robot.key"]}
blocks = {"shared_memory": "elsewhere", "udp": "remote", "yarp": "behind_yarp", "ros2": "behind_ros2"}
tolerance = {"yarp": 1e-6}
by_clock = ["--realtime", "--priority", 0, "--watchdog", 20]  # the ports of YARP are opened in the first step
by_the_clock = {"yarp": ["--set", "behind_yarp.simulator=''"], "ros2": ["--set", "behind_ros2.step_size=0"]}
if "Ros2" in plugins:
    ways["ros2"] = ["--ros2", "/icub"]
if "Yarp" in plugins and (options.yarp / "bin/yarpserver").exists():
    ways["yarp"] = ["--yarp", "icubSim"]
    home = tempfile.TemporaryDirectory()  # which packages see, too
    pathlib.Path(home.name, "yarp.conf").write_text("127.0.0.1 10000 yarp\n")
    os.environ |= {"YARP_CONFIG_HOME": home.name, "YARP_DATA_HOME": home.name}
    name_server = subprocess.Popen([options.yarp / "bin/yarpserver", "--ip", "127.0.0.1", "--socket", "10000", "--read"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    atexit.register(name_server.kill)
curves = {}  # way -> world.com


def serve(way, *more):
    """The server, once the robot is there."""
    command = [bf, "serve", model, "--set", "robot_is='served'", *ways[way], *more]
    print("$", *command, flush=True)
    server = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    next_line(server, "serves the ")
    return server


def next_line(server, wanted):
    """What it says of that, after what it says of other things."""
    told = []
    for line in server.stderr:
        told.append(line)
        if wanted in line:
            return line
    raise AssertionError("".join(told))


def of(way):
    settings = {"shared_memory": [f"elsewhere.name='{name}'"],
                "udp": [f"remote.address='{port}'", f"remote.key='{out / 'robot.key'}'"]}.get(way, [])
    return ["--set", f"robot_is='{way}'"] + [word for text in settings for word in ("--set", text)]


def drive(way, *more):
    command = [bf, "run", model, "--quiet", *of(way), *more]
    print("$", *command, flush=True)
    return [str(c) for c in command]


def ended(server):
    """What the server has told."""
    text = server.communicate(timeout=60)[1]
    assert server.returncode == 0, text
    return text


def same(what, reference, other, signals, most=0):
    count, largest, first = recorded.compare({s: reference[s] for s in signals}, other)
    print(f"  {what}: {count} numbers compared, largest difference {largest:g}", flush=True)
    assert count > 1000 and largest <= most, f"{what}: {first}"


recorded.run(bf, "run", model, "--quiet", "--stop", seconds, "--record", out / "direct.mcap")
direct = recorded.read_recording(bf, out / "direct.mcap")
of_world = [s for s in direct if s.startswith("world.")]
of_controller = [s for s in direct if s.startswith("controller.")]
curves["its world"] = direct["world.com"]


def same_world(what, way, world):
    # The robot does not go on any more when its controller has left, which steps those of YARP and ROS 2 by its own period.
    until = (options.seconds - (0.0105 if way in ("yarp", "ros2") else 0)) * 1e9
    same(what, {s: {t: rows for t, rows in direct[s].items() if t <= until} for s in of_world}, world, of_world,
         tolerance.get(way, 0))


for way in ways if not options.deploy else []:
    # Step by step.
    server = serve(way, "--once", "--record", out / f"{way}_world.mcap")
    recorded.run(*drive(way, "--stop", seconds, "--record", out / f"{way}.mcap"), timeout=None)
    told = ended(server)
    assert "a controller has come" in told and "the controller has left; its joints hold" in told, told
    world = recorded.read_recording(bf, out / f"{way}_world.mcap")
    same_world(f"{way}, the world", way, world)
    same(f"{way}, the controller", direct, recorded.read_recording(bf, out / f"{way}.mcap"), of_controller,
         tolerance.get(way, 0))
    curves[way] = world["world.com"]

    # Without the robot: what came from it is in the recording.
    replay = recorded.run(bf, "replay", out / f"{way}.mcap").stdout
    assert "identical" in replay and "from outside were taken from the recording" in replay, replay
    print(f"  {way}, replay: {replay.strip()}")

    # By the clock, each side by its own.
    server = serve(way, "--once", *by_clock, "--silence", 5, "--record", out / f"{way}_clock.mcap")
    result = recorded.run(*drive(way, "--stop", seconds, "--realtime", "--priority", 0, "--set",
                                 f"{blocks[way]}.clock='own'", *by_the_clock.get(way, []), "--record", out / f"{way}_own.mcap"), timeout=None).stdout
    ended(server)
    assert f"{blocks[way]}.final_drift" in result and f"{blocks[way]}.worst_age" in result, result
    times = recorded.read_recording(bf, out / f"{way}_own.mcap")[f"{blocks[way]}.time"]
    began = round(times[min(times)][0][0] * 1e9)  # of the robot, when the controller came
    curves[f"{way}, by the clock"] = {t - began: rows for t, rows in recorded.read_recording(
        bf, out / f"{way}_clock.mcap")["world.com"].items() if t >= began}

    # The controller is killed, and the joints are held where they are.
    server = serve(way, "--stop", "8", *by_clock, "--record", out / f"{way}_killed.mcap")
    controller = subprocess.Popen(drive(way, "--stop", "Inf", *by_the_clock.get(way, [])), stdout=subprocess.DEVNULL)
    next_line(server, "a controller has come")
    time.sleep(0.5)
    controller.send_signal(signal.SIGKILL)
    controller.wait()
    told = ended(server)
    assert "joints hold" in told and any(how in told for how in ("has died", "has left", "no command")), told
    height = min(row[2] for rows in recorded.read_recording(bf, out / f"{way}_killed.mcap")["world.com"].values()
                 for row in rows)
    print(f"  {way}, the controller killed: the centre of mass stays above {height:.3f} m")
    assert height > 0.4, "it fell"

for way in ways if options.deploy else []:
    (out / "robot.key").unlink(missing_ok=True)  # which is no part of a package; the server makes it
    with tempfile.TemporaryDirectory() as folder:
        package = pathlib.Path(folder) / "package"
        recorded.run(bf, "deploy", model, *of(way), "-o", package, timeout=None)
        server = serve(way, "--once", "--record", out / "deployed_world.mcap")
        words = [package / "run", "--quiet", "--priority", "0", "--stop", seconds]
        needed = {k: v for k, v in os.environ.items() if way == "yarp" and k.startswith("YARP_")}  # where its name server is
        result = subprocess.run(words, env=needed | {"PATH": "/usr/bin:/bin"}, cwd="/", capture_output=True, text=True,
                                preexec_fn=lambda: alone.hide(bf))
        assert result.returncode == 0, result.stdout + result.stderr
        ended(server)
    world = recorded.read_recording(bf, out / "deployed_world.mcap")
    same_world(f"{way}, deployed package, the world", way, world)
    curves[f"{way}, deployed"] = world["world.com"]

# One panel for each axis, later curves thinner, so that all are seen.
colours = ["#c8c8c8", "#f2a33a", "#2f8f5b", "#3366cc", "#b03060", "#000000", "#00a0b0", "#8a5a2b", "#7a5fd0", "#d94f4f", "#6b8e23", "#556b8d"]
width, height, left, gap = 860, 150, 70, 180
parts = []
end = max(curves["its world"])
for axis, label in enumerate("xyz"):
    top = 30 + gap * axis
    values = [row[axis] for curve in curves.values() for t, rows in curve.items() if t <= end for row in rows]
    low, high = min(values) - 1e-4, max(values) + 1e-4
    parts.append(f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>')
    parts.append(f'<text x="{left}" y="{top - 6}">centre of mass, {label} [m]</text>')
    for value, y in ((high, top + 10), (low, top + height)):
        parts.append(f'<text x="{left - 6}" y="{y}" text-anchor="end">{value:.4g}</text>')
    for k, curve in enumerate(curves.values()):
        rows = [(t, rows[-1]) for t, rows in sorted(curve.items()) if t <= end]
        points = " ".join(f"{left + t / end * width:.1f},{top + height - (min(max(row[axis], low), high) - low) / (high - low) * height:.1f}"
                          for t, row in rows[:: max(1, len(rows) // 400)])
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colours[k % len(colours)]}" stroke-width="{max(1, 9 - 3 * k)}"/>')
for k, label in enumerate(curves):
    parts.append(f'<text x="{left + 215 * (k % 4)}" y="{30 + 3 * gap + 16 * (k // 4)}" fill="{colours[k % len(colours)]}">{label}</text>')
(out / "elsewhere.svg").write_text(
    f'<svg xmlns="http://www.w3.org/2000/svg" width="960" height="{3 * gap + 70}" font-family="sans-serif" font-size="12">\n'
    '<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(parts) + "\n</svg>\n")
print(f"all trajectories: {out}/elsewhere.svg")
