#!/usr/bin/env python3
"""Do ten topics of ROS 2 disturb the real-time loop? Prints what it measured as JSON, s by name; nothing where the plugin Ros2 is absent.

Usage: ros2_topics_benchmark.py BUILD. A model of 1 kHz runs with `bf run --realtime`, with five topics that it publishes in each
step and five that another program publishes at 1 kHz, which hears those five; without topics; once more without, whose difference is the scatter; and
without beside two programs that exchange the ten topics, which tells what the load of the processors does where the loop has no topic. The four alternate in an
order that changes, and the median of all rounds counts. The figure is the 99.9th percentile of the time from the beginning of a step to that of the next one.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROUNDS = 9
SECONDS = 4
TOPICS = 5
JOINTS = 23


def model(name, publishes, subscribes, topics=True):
    """Joint states to and fro; without topics the sines alone."""
    blocks, connections = [], []
    if topics:
        blocks.append(f"  node: {{block: Ros2/Node, name: {name}}}")
    for i in range(TOPICS):
        blocks.append(f"  q{i}: {{block: Sine, amplitude: [{' '.join(['0.1'] * JOINTS)}], frequency: {i + 1}}}")
        if not topics:
            continue
        common = "type: sensor_msgs/msg/JointState, fields: \"{'position', 'velocity'}\""
        blocks.append(f"  out{i}: {{block: Ros2/Publish, topic: /{publishes}{i}, {common}}}")
        # The program that begins first cannot wait for the other one.
        waits = 30 if name == "loop" else 0
        sizes = f"sizes: \"{{'position={JOINTS}', 'velocity={JOINTS}'}}\""
        blocks.append(f"  in{i}: {{block: Ros2/Subscribe, topic: /{subscribes}{i}, start_timeout: {waits}, {common}, {sizes}}}")
        connections.append(f"  q{i}: [out{i}.position, out{i}.velocity]")
    text = f"model: {name}\nplugins: [Ros2]\nstep: 0.001\nblocks:\n" + "\n".join(blocks) + "\n"
    return text + ("connections:\n" + "\n".join(connections) + "\n" if connections else "")


def main(build):
    bf = build / "bin/bf"
    if not (build / "lib/blockfactory/Ros2.so").exists():
        print("{}")
        return
    # Nobody else is heard.
    environment = os.environ | {"ROS_DOMAIN_ID": str(os.getpid() % 90 + 10)}
    with tempfile.TemporaryDirectory(prefix="bf_topics_") as name:
        folder = pathlib.Path(name)
        (folder / "peer.yaml").write_text(model("peer", "back", "there"))
        (folder / "loop.yaml").write_text(model("loop", "there", "back"))
        (folder / "alone.yaml").write_text(model("alone", "", "", topics=False))
        # The model that is measured and the programs beside it.
        kinds = {"with": ("loop", ["peer"]), "without": ("alone", []), "again": ("alone", []), "beside": ("alone", ["loop", "peer"])}
        found = {kind: [] for kind in kinds}
        order = list(kinds)
        for _ in range(ROUNDS):
            for kind in order:
                measured, others = kinds[kind]
                beside = [subprocess.Popen([bf, "run", folder / f"{other}.yaml", "--realtime", "--priority", "0", "--stop", "Inf", "--quiet"],
                                           env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for other in others]
                try:
                    subprocess.run([bf, "run", folder / f"{measured}.yaml", "--realtime", "--stop", "Inf", "--duration", str(SECONDS), "--quiet",
                                    "--summary", folder / "summary.json"], env=environment, check=True,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                finally:
                    for other in beside:
                        other.terminate()
                        other.wait()
                told = json.loads((folder / "summary.json").read_text())["realtime"]
                found[kind].append(told["deviation_us"]["p99_9"] / 1e6)
            order = order[1:] + order[:1]
    print(json.dumps({f"realtime.ten_topics/{kind}": 1e-3 + statistics.median(each) for kind, each in found.items()} |
                     {f"realtime.ten_topics/{kind}_deviation": statistics.median(each) for kind, each in found.items()}))


main(pathlib.Path(sys.argv[1]).resolve())
