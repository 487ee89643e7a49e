"""joint_names.py BF MODEL: joints are called as in the URDF, in recordings, tables, events and plots. The names are read from
the URDF as XML.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

import icub_models
import websockets.sync.client

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from recorded import columns, columns_of_recording, run

bf, model = sys.argv[1:]
WHOLE = """
model: whole
step: 0.001
stop: 0.002
blocks:
  robot: {{block: WholeBodyToolbox/Configuration, robot: "'{urdf}'"}}
  world: {{block: WholeBodyToolbox/MujocoWorld}}
  rest: {{block: Constant, value: "{zeros}"}}
  error: {{block: Sum, signs: "+-"}}
  stiffness: {{block: Gain, K: 10}}
  bias: {{block: WholeBodyToolbox/GetBiasForces}}
connections: {{rest: error.u1, world.s: [error.u2, bias.s], error: stiffness, stiffness: world.tau, world.w_H_b: bias.w_H_b,
  world.v_b: bias.v_b, world.s_dot: bias.s_dot}}
record: [world.s, rest, stiffness, bias.h]
"""
LIVE = """
model: live
step: 0.01
stop: 60
blocks:
  robot: {{block: WholeBodyToolbox/Configuration, robot: "'{urdf}'"}}
  limits: {{block: WholeBodyToolbox/GetLimits}}
"""


def elements(names, signal):
    """In brackets behind the signal's name, of the columns in `names`."""
    return {found[1] for name in names if (found := re.fullmatch(re.escape(signal) + r"\[(.*)\]", name))}


def refused(*command):
    return run(bf, *command, code=1).stderr


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    recording = folder / "run.mcap"
    run(bf, "run", model, "--set", "stop=0.05", "--quiet", "--record", recording)
    blocks = {block["path"]: block for block in json.loads(run(bf, "check", model, "--json").stdout)["blocks"]}
    quantities = {quantity["name"]: quantity for quantity in blocks["world"]["quantities"]}
    order = quantities["s"]["elements"]

    # The URDF that the model names lies among those of the package.
    urdf = icub_models.get_model_file("iCubGazeboV2_5")
    movable = [joint.get("name") for joint in ET.parse(urdf).getroot().findall("joint")
               if joint.get("type") != "fixed" and joint.find("mimic") is None]
    named = columns_of_recording(bf, recording)
    assert len(order) == 23 and set(order) <= set(movable), order
    for signal in ("world.s", "controller.tau"):
        assert elements(named, signal) == set(order), (signal, elements(named, signal))
    assert elements(named, "world.com") == {"1", "2", "3"}, "these are no joints"

    # Plots and events take names and numbers.
    run(bf, "plot", recording, "world.s[l_knee],world.s[15]", "-o", folder / "knee.svg")
    drawn = (folder / "knee.svg").read_text()
    assert drawn.count("world.s[l_knee]") >= 2 and "r_knee" not in drawn, drawn
    assert "has no element [0]; they are counted from 1: [torso_pitch], " in refused("plot", recording, "world.s[0]")
    first = [run(bf, "run", model, "--set", "stop=0.05", "--quiet", "--until", f"world.s[{element}] < 9").stdout
             for element in ("l_knee", order.index("l_knee") + 1)]
    assert "world.s[l_knee] < 9 at t = 0 s" in first[0] and "world.s[15] < 9 at t = 0 s" in first[1], first

    # All joints in the order of the file; a reference and a generalised velocity have their names too.
    (folder / "whole.yaml").write_text(WHOLE.format(urdf=urdf, zeros=f"zeros({len(movable)}, 1)"))
    run(bf, "run", folder / "whole.yaml", "--quiet", "--record", recording)
    named = columns_of_recording(bf, recording)
    for signal in ("world.s", "rest", "stiffness"):
        assert elements(named, signal) == set(movable), (signal, elements(named, signal) ^ set(movable))
    base = {"base_x", "base_y", "base_z", "base_rx", "base_ry", "base_rz"}
    assert elements(named, "bias.h") == base | set(movable)

    # A viewer of a running model is told.
    (folder / "live.yaml").write_text(LIVE.format(urdf=urdf))
    with subprocess.Popen([bf, "run", folder / "live.yaml", "--realtime", "--priority", "0", "--serve", "0", "--quiet"],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as live:
        try:
            address = next(found[0] for line in live.stderr if (found := re.search(r"ws://\S+", line)))
            with websockets.sync.client.connect(address, subprotocols=["foxglove.websocket.v1"]) as viewer:
                told = json.loads(viewer.recv())["metadata"]
        finally:
            live.terminate()
    assert told["elements of /limits/minimum"] == "".join(joint + "\n" for joint in movable), told
