"""Every robot of the wheel example-robot-data in a model: its world and rigid-body blocks run 0.2 s with a fixed and, where
its root may move, with a floating base; M, h and the centre of mass at the end are those of iDynTree; a picture is drawn.

usage: robots.py BF FOLDER (--compare TABLE | --write TABLE) [NAME...]
FOLDER is what `make robots` installed. The table says what ran, and why a robot did not."""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

import numpy as np

MODEL = """model: robot
plugins: [WholeBodyToolbox]
step: 0.001
stop: 0.2
variables: {{floating: true}}
blocks:
  robot: {{block: WholeBodyToolbox/Configuration, robot: "'{urdf}'", floating_base: floating}}
  world: {{block: WholeBodyToolbox/MujocoWorld, floor: false}}
  M: {{block: WholeBodyToolbox/MassMatrix}}
  h: {{block: WholeBodyToolbox/GetBiasForces}}
  com: {{block: WholeBodyToolbox/CenterOfMass}}
  tau: {{block: Gain, K: 0}}
record: [world.w_H_b, world.v_b, world.com, com.com{more}]
connections:
  world.w_H_b: [M.w_H_b, h.w_H_b, com.w_H_b]
  world.v_b: [h.v_b, com.v_b]
  world.s: [M.s, h.s, com.s]
  world.s_dot: [h.s_dot, com.s_dot, tau]
  tau: world.tau
"""


def followers(urdf, listed):
    """Joints that follow listed ones: name -> (leader, factor, offset)."""
    movable = {j.get("name"): j for j in ET.parse(urdf).getroot().findall("joint")
               if j.get("type") in ("revolute", "continuous", "prismatic")}
    mimic = {}
    for name, joint in movable.items():
        m = joint.find("mimic")
        if m is not None and m.get("joint") in movable:
            mimic[name] = (m.get("joint"), float(m.get("multiplier", 1)), float(m.get("offset", 0)))
    listed = [name for name in movable if name not in mimic] if listed is None else listed
    found = {}
    for name in mimic:
        leader, factor, offset = mimic[name]
        while leader not in listed and leader in mimic:
            following, m, b = mimic[leader]
            leader, factor, offset = following, factor * m, offset + factor * b
        if name not in listed and leader in listed:
            found[name] = (leader, factor, offset)
    return listed, found


def oracle(urdf, w_H_b, v_b, s, s_dot, floating):
    """M, h and the centre of mass by iDynTree, followers folded into their leaders."""
    import idyntree.bindings as idyn
    listed, follow = followers(urdf, None)
    joints = listed + list(follow)
    loader = idyn.ModelLoader()
    tree = ET.parse(urdf)
    for inertial in tree.iter("inertial"):  # iDynTree forgets the inertia of links that have no mass
        if float(inertial.find("mass").get("value")) == 0:
            inertial.find("mass").set("value", "1e-15")
    if not loader.loadReducedModelFromString(ET.tostring(tree.getroot(), encoding="unicode"), joints, "urdf"):
        raise RuntimeError("iDynTree cannot read it")
    k = idyn.KinDynComputations()
    k.loadRobotModel(loader.model())
    k.setFrameVelocityRepresentation(idyn.MIXED_REPRESENTATION)
    root = tree.getroot()
    children = {j.find("child").get("link") for j in root.findall("joint")}
    k.setFloatingBase(next(l.get("name") for l in root.findall("link") if l.get("name") not in children))
    n, wide = len(listed), len(joints)
    G = np.zeros((wide, n))
    G[:n, :n] = np.eye(n)
    offset = np.zeros(wide)
    for i, name in enumerate(follow):
        leader, factor, constant = follow[name]
        G[n + i, listed.index(leader)] = factor
        offset[n + i] = constant
    k.setRobotState(w_H_b, G @ s + offset, v_b, G @ s_dot, np.array([0, 0, -9.81]))
    big = np.zeros((6 + wide, 6 + n))
    big[:6, :6] = np.eye(6)
    big[6:, 6:] = G
    M = idyn.MatrixDynSize(6 + wide, 6 + wide)
    k.getFreeFloatingMassMatrix(M)
    h = idyn.FreeFloatingGeneralizedTorques(k.model())
    k.generalizedBiasForces(h)
    h = np.concatenate([h.baseWrench().toNumPy(), h.jointTorques().toNumPy()])
    M, h = big.T @ M.toNumPy() @ big, big.T @ h
    first = 0 if floating else 6
    return M[first:, first:], h[first:], k.getCenterOfMassPosition().toNumPy()


def last_values(bf, recording):
    """Signals of a recording at its end."""
    from scipy.io import loadmat
    table = recording.with_suffix(".mat")
    subprocess.run([bf, "export", recording, "-o", table], check=True, capture_output=True)
    values = {}
    for name, signal in loadmat(table, simplify_cells=True).items():
        if not name.startswith("__"):
            data = np.asarray(signal["signals"]["values"], float)
            values[name] = data[..., -1] if data.ndim == 3 else data[-1]
    return values


def run(bf, urdf, floating, folder, film):
    """Runs, compares and draws; returns the number of joints and of links whose inertia was mended. Raises with the reason."""
    model, recording = folder / "robot.yaml", folder / "run.mcap"
    joints = followers(urdf, None)[0]  # what has no elements is not recorded
    more = (", world.s, world.s_dot" if joints else "") + (", M, h" if joints or floating else "")
    model.write_text(MODEL.format(urdf=urdf, more=more))
    setting = ["--set", f"floating={str(floating).lower()}"]
    def reason(stderr):
        lines = [line for line in stderr.splitlines() if line.strip() and not line.startswith("bf: warning")]
        return next((line for line in lines if "rror" in line or "was not found" in line), lines[-1] if lines else "?")

    done = subprocess.run([bf, "run", model, "--quiet", "--record", recording, *setting], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(reason(done.stderr))
    v = last_values(bf, recording)
    get = lambda signal: np.atleast_1d(v[signal.replace(".", "_")])
    s, s_dot = (get("world.s"), get("world.s_dot")) if joints else (np.zeros(0), np.zeros(0))
    M, h, com = oracle(urdf, get("world.w_H_b"), get("world.v_b"), s, s_dot, floating)
    figures = [("com", get("com.com"), com, 1e-9), ("world.com", get("world.com"), com, 1e-5)]
    if joints or floating:
        figures += [("M", np.atleast_2d(v["M"]), M, 1e-9), ("h", get("h"), h, 1e-9)]
    for what, ours, theirs, tolerance in figures:
        error = np.abs(ours - theirs).max() / max(1, np.abs(theirs).max())
        if not error < tolerance:
            raise RuntimeError(f"{what} differs by {error:.1e}")
    mended = done.stderr.count("which no body has") + done.stderr.count("moves without")
    picture = folder / "picture.png"
    done = subprocess.run([bf, "film", model, recording, *setting, "--picture", picture, "--width", "160", "--height", "160"],
                          capture_output=True, text=True) if film else done
    if done.returncode != 0:
        raise RuntimeError("film: " + reason(done.stderr))
    return len(s), mended


def row(bf, urdf, name, folder):
    links = {l.get("name") for l in ET.parse(urdf).getroot().findall("link")}
    result, counts = [], None
    kinds = (False,) if "world" in links else (False, True)
    for floating in kinds:
        try:
            counts = run(bf, urdf, floating, folder, film=floating == kinds[-1])
            result.append("yes")
        except Exception as error:  # any failure is a row
            result.append(re.sub(r"[^\s']*/", "", str(error)).replace("|", "/"))
    result += ["root is the world"] * (2 - len(result))
    joints, mended = counts or ("", "")
    return f"| {name} | {joints} | {mended or ''} | {result[0]} | {result[1]} |", "yes" in result


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("bf")
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--compare", type=pathlib.Path)
    arguments.add_argument("--write", type=pathlib.Path)
    arguments.add_argument("names", nargs="*")
    given = arguments.parse_args()
    share = given.folder.absolute() / "cmeel.prefix/share"
    robots = share / "example-robot-data/robots"
    if not robots.is_dir():
        print(f"{robots} is missing: make robots")
        sys.exit(77)
    os.environ["ROS_PACKAGE_PATH"] = str(share)
    rows, works = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for urdf in sorted(robots.rglob("*.urdf")):
            name = str(urdf.relative_to(robots))
            if given.names and not any(part in name for part in given.names):
                continue
            text, good = row(given.bf, urdf, name, pathlib.Path(folder))
            print(text, flush=True)
            rows.append(text)
            works += good
    table = HEAD.format(works=works, all=len(rows)) + "\n".join(rows) + "\n"
    if given.write:
        given.write.write_text(table)
    if given.compare and given.compare.read_text() != table:
        sys.exit(f"{given.compare} says otherwise: make robots writes it again")


HEAD = """# Robots that were tried

{works} of the {all} robots of `example-robot-data` 6.0.0 run; written by `make robots`. A run is a model with the robot's
world and rigid-body blocks, all joints but mimicking ones movable, 0.2 s long; at its end M, h and the centre of mass are
those of iDynTree to 1e-9, and `bf film` draws a picture. Links whose inertia no body can have are mended in the world, with
a warning that names them.

| robot | joints | mended links | fixed base | floating base |
| --- | --- | --- | --- | --- |
"""

if __name__ == "__main__":
    main()
