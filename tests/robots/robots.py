"""Every robot of the wheel example-robot-data in a model: its world and all rigid-body blocks run 0.2 s with a fixed and, where
its root may move, with a floating base; what the blocks tell at the end is what iDynTree tells, or follows from it; a picture is drawn.

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
variables: {{floating: true, forward: true}}
blocks:
  robot: {{block: WholeBodyToolbox/Configuration, robot: "'{urdf}'", floating_base: floating}}
  world: {{block: WholeBodyToolbox/MujocoWorld, floor: false}}
  tau: {{block: Gain, K: 0}}
  # The blocks compute at another state than that of the world, in which nothing is zero.
  turned: {{block: Constant, value: "[0.36 0.48 -0.8 0.1; -0.8 0.6 0 -0.2; 0.48 0.64 0.6 0.3; 0 0 0 1]"}}
  pose: {{block: ComposePoses}}
  v: {{block: Bias, bias: "floating*[0.3; -0.2; 0.1; 0.5; -0.4; 0.2]"}}
  s: {{block: Bias, bias: 0.2}}
  s_dot: {{block: Bias, bias: -0.3}}
  v_b_dot: {{block: Constant, value: "floating*[0.1; -0.2; 0.3; 0.4; -0.5; 0.6]"}}
  s_ddot: {{block: Bias, bias: 0.5}}
  torque: {{block: Bias, bias: 0.7}}
  wrench: {{block: Constant, value: "[1; -2; 3; 0.4; 0.5; -0.6]"}}
  H: {{block: WholeBodyToolbox/ForwardKinematics, frame: "'{tip}'"}}
  J: {{block: WholeBodyToolbox/Jacobian, frame: "'{tip}'"}}
  J_dot_nu: {{block: WholeBodyToolbox/DotJNu, frame: "'{tip}'"}}
  com: {{block: WholeBodyToolbox/CenterOfMass}}
  M: {{block: WholeBodyToolbox/MassMatrix}}
  M_dot: {{block: WholeBodyToolbox/MassMatrixDerivative}}
  C: {{block: WholeBodyToolbox/CoriolisMatrix}}
  h: {{block: WholeBodyToolbox/GetBiasForces}}
  g: {{block: WholeBodyToolbox/GetGravityForces}}
  c: {{block: WholeBodyToolbox/GetCoriolisForces}}
  id: {{block: WholeBodyToolbox/InverseDynamics}}
  fd: {{block: WholeBodyToolbox/ForwardDynamics, frames: ["{tip}"], when: forward}}
  momentum: {{block: WholeBodyToolbox/CentroidalMomentum}}
  A: {{block: WholeBodyToolbox/CentroidalTotalMomentumMatrix}}
  A_dot_nu: {{block: WholeBodyToolbox/DotANu}}
  other_H_tip: {{block: WholeBodyToolbox/RelativeTransform, frame1: "'{other}'", frame2: "'{tip}'"}}
{jointed}
record: [world.w_H_b, world.com, pose, v, com.com, com.com_dot, H, J_dot_nu, momentum, A_dot_nu, other_H_tip{more}]
connections:
  world.w_H_b: pose.a_H_b
  turned: pose.b_H_c
  pose: [{pose}]
  world.v_b: v
  v: [J_dot_nu.v_b, com.v_b, M_dot.v_b, C.v_b, h.v_b, c.v_b, id.v_b, fd.v_b, momentum.v_b, A_dot_nu.v_b]
  world.s: [s, torque]
  s: [{pose_s}, other_H_tip.s{relative_s}]
  world.s_dot: [s_dot, tau]
  s_dot: [s_ddot, J_dot_nu.s_dot, com.s_dot, M_dot.s_dot, C.s_dot, h.s_dot, c.s_dot, id.s_dot, fd.s_dot, momentum.s_dot, A_dot_nu.s_dot]
  v_b_dot: id.v_b_dot
  s_ddot: id.s_ddot
  torque: fd.tau
  wrench: fd.wrench_{tip}
  tau: world.tau
"""
COMPUTE = ["H", "J", "J_dot_nu", "com", "M", "M_dot", "C", "h", "g", "c", "id", "fd", "momentum", "A", "A_dot_nu"]
# What only a robot with joints has; the target of the inverse kinematics is where the frame is at joint positions within the limits.
JOINTED = """  other_J_tip: {{block: WholeBodyToolbox/RelativeJacobian, reference: "'{other}'", frame: "'{tip}'"}}
  limits: {{block: WholeBodyToolbox/GetLimits, limit_type: ModelPosition}}
  rest: {{block: Gain, K: 0}}
  wanted: {{block: Bias, bias: 0.4}}
  within: {{block: SaturateDynamic}}
  target: {{block: WholeBodyToolbox/ForwardKinematics, frame: "'{tip}'"}}
  ik: {{block: WholeBodyToolbox/InverseKinematics, pose: ["{tip}"]}}
"""
JOINTED_CONNECTIONS = """  rest: wanted
  wanted: within.u
  limits.minimum: within.lower
  limits.maximum: within.upper
  within: target.s
  target: ik.w_H_{tip}
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


def frames_of(urdf):
    """A frame far from the root and one that moves otherwise, of names that ports may have."""
    root = ET.parse(urdf).getroot()
    parent = {j.find("child").get("link"): j.find("parent").get("link") for j in root.findall("joint")}

    def depth(link):
        return 1 + depth(parent[link]) if link in parent else 0

    links = sorted((l.get("name") for l in root.findall("link") if "." not in l.get("name")), key=depth)
    leaves = [l for l in links if l not in parent.values()] or links
    if not leaves:
        return "none", "none"  # no robot, as the program will say
    return leaves[-1], leaves[-2] if len(leaves) > 1 else links[len(links) // 2]


def turn(w):
    """Rotation of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(w)
    S = skew(w / angle) if angle > 0 else np.zeros((3, 3))
    return np.eye(3) + np.sin(angle) * S + (1 - np.cos(angle)) * S @ S


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


class Oracle:
    """iDynTree, followers folded into their leaders."""

    def __init__(self, urdf, floating):
        import idyntree.bindings as idyn
        self.idyn, self.first = idyn, 0 if floating else 6  # where rows and columns begin: a fixed base has none of its own
        listed, follow = followers(urdf, None)
        joints = listed + list(follow)
        loader = idyn.ModelLoader()
        tree = ET.parse(urdf)
        for inertial in tree.iter("inertial"):  # iDynTree forgets the inertia of links that have no mass
            if float(inertial.find("mass").get("value")) == 0:
                inertial.find("mass").set("value", "1e-15")
        root = tree.getroot()
        children = {j.find("child").get("link") for j in root.findall("joint")}
        base = next(l for l in root.findall("link") if l.get("name") not in children)
        if base.find("inertial") is None:  # or it takes the next link as its base, and forgets how far it is in accelerations
            inertial = ET.SubElement(base, "inertial")
            ET.SubElement(inertial, "mass", value="1e-15")
            ET.SubElement(inertial, "inertia", ixx="0", ixy="0", ixz="0", iyy="0", iyz="0", izz="0")
        if not loader.loadReducedModelFromString(ET.tostring(root, encoding="unicode"), joints, "urdf"):
            raise RuntimeError("iDynTree cannot read it")
        self.k = idyn.KinDynComputations()
        self.k.loadRobotModel(loader.model())
        self.k.setFrameVelocityRepresentation(idyn.MIXED_REPRESENTATION)
        self.k.setFloatingBase(base.get("name"))
        self.n, self.wide = len(listed), len(joints)
        self.G, self.offset = np.eye(self.wide, self.n), np.zeros(self.wide)
        for i, name in enumerate(follow):
            leader, factor, constant = follow[name]
            self.G[self.n + i, listed.index(leader)] = factor
            self.offset[self.n + i] = constant
        self.all = np.zeros((6 + self.wide, 6 + self.n))
        self.all[:6, :6], self.all[6:, 6:] = np.eye(6), self.G

    def set(self, w_H_b, v_b, s, s_dot):
        self.k.setRobotState(w_H_b, self.G @ s + self.offset, v_b, self.G @ s_dot, np.array([0, 0, -9.81]))

    def H(self, frame):
        return self.k.getWorldTransform(frame).asHomogeneousTransform().toNumPy().copy()

    def M(self):
        M = self.idyn.MatrixDynSize(6 + self.wide, 6 + self.wide)
        self.k.getFreeFloatingMassMatrix(M)
        return self.all.T @ M.toNumPy() @ self.all

    def J(self, frame):
        J = self.idyn.MatrixDynSize(6, 6 + self.wide)
        self.k.getFrameFreeFloatingJacobian(frame, J)
        return J.toNumPy() @ self.all

    def forces(self, compute):
        h = self.idyn.FreeFloatingGeneralizedTorques(self.k.model())
        compute(h)
        return self.all.T @ np.concatenate([h.baseWrench().toNumPy(), h.jointTorques().toNumPy()])

    def figures(self, values, tip, other):
        """What each signal must be, and how well: by iDynTree, or from its M, h and J by identities."""
        w_H_b, v_b, s, s_dot = values["pose"], values["v"], values["s"], values["s_dot"]
        nu, cut = np.concatenate([v_b, s_dot]), slice(self.first, None)
        step, M_near = 1e-6, []
        for sign in (1, -1):  # M along the motion
            moved = w_H_b.copy()
            moved[:3, :3], moved[:3, 3] = turn(sign * step * v_b[3:]) @ w_H_b[:3, :3], w_H_b[:3, 3] + sign * step * v_b[:3]
            self.set(moved, v_b, s + sign * step * s_dot, s_dot)
            M_near.append(self.M())
        M_dot = (M_near[0] - M_near[1]) / (2 * step)
        self.set(w_H_b, v_b, s, s_dot)
        M, J = self.M(), self.J(tip)
        h, g = self.forces(self.k.generalizedBiasForces), self.forces(self.k.generalizedGravityForces)
        c, com = h - g, self.k.getCenterOfMassPosition().toNumPy().copy()
        A = self.idyn.MatrixDynSize(6, 6 + self.wide)
        self.k.getCentroidalTotalMomentumJacobian(A)
        H_tip, H_other = self.H(tip), self.H(other)
        J_dot_nu = self.k.getFrameBiasAcc(tip).toNumPy().copy()
        R, far = H_other[:3, :3].T, H_tip[:3, 3] - H_other[:3, 3]
        apart = J - self.J(other)
        apart[:3] += skew(far) @ self.J(other)[3:]
        wrench = np.array([1, -2, 3, 0.4, 0.5, -0.6])
        push = J.T @ wrench - h
        push[6:] += values["torque"]
        nu_dot = np.concatenate([[0.1, -0.2, 0.3, 0.4, -0.5, 0.6] if not self.first else np.zeros(6), s_dot + 0.5])
        exact = 1e-9
        found = {
            "H": (H_tip, exact), "J_dot_nu": (J_dot_nu, exact), "com.com": (com, exact),
            "com.com_dot": (self.k.getCenterOfMassVelocity().toNumPy().copy(), exact),
            "momentum": (self.k.getCentroidalTotalMomentum().asVector().toNumPy().copy(), exact),
            # What changes the momentum when nothing accelerates but the bias: the wrench on the base, about the centre of mass.
            "A_dot_nu": (np.concatenate([c[:3], c[3:6] - np.cross(com - w_H_b[:3, 3], c[:3])]), exact),
            "other_H_tip": (np.linalg.inv(H_other) @ H_tip, exact)}
        if self.n or not self.first:
            found |= {
                "J": (J[:, cut], exact), "M": (M[cut, cut], exact), "M_dot": (M_dot[cut, cut], 1e-6), "h": (h[cut], exact),
                "g": (g[cut], exact), "c": (c[cut], exact), "A": (A.toNumPy() @ self.all[:, cut], exact),
                "id": ((M @ nu_dot + h)[cut], exact), "C nu": (c[cut], exact), "C + C'": (M_dot[cut, cut], 1e-6)}
            accelerations = [values[signal] for signal in ("fd.v_b_dot", "fd.s_ddot") if signal in values]
            if accelerations:  # none where M is singular
                values["fd"] = np.concatenate(accelerations)
                found["fd"] = (np.linalg.solve(M[cut, cut], push[cut]), 1e-6)
            C = np.reshape(values["C"], M[cut, cut].shape)
            values["C nu"], values["C + C'"] = C @ nu[cut], C + C.T
        if self.n:
            found["other_J_tip"] = (np.vstack([R @ apart[:3, 6:], R @ apart[3:, 6:]]), exact)
            self.set(w_H_b, v_b, values["ik.s"], s_dot)
            reached = self.H(tip)
            self.set(w_H_b, v_b, values["within"], s_dot)
            values["ik"] = reached
            found["ik"] = (self.H(tip), 1e-5)
        self.set(values["world.w_H_b"], v_b, values["world.s"], s_dot)
        found["world.com"] = (self.k.getCenterOfMassPosition().toNumPy().copy(), 1e-5)
        return found


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


def fill(urdf, joints, floating):
    """The model, and the two frames in it."""
    tip, other = frames_of(urdf)
    pose = ", ".join(f"{block}.w_H_b" for block in COMPUTE) + (", target.w_H_b, ik.w_H_b_0" if joints else "")
    more = ", J, M, M_dot, C, h, g, c, id, A" if joints or floating else ""
    more += ", fd.v_b_dot" if floating else ""
    more += ", world.s, s, s_dot, torque, fd.s_ddot, other_J_tip, ik.s, ik.status, within" if joints else ""
    text = MODEL.format(urdf=urdf, tip=tip, other=other, jointed=JOINTED.format(tip=tip, other=other) if joints else "", more=more, pose=pose,
                        pose_s=", ".join(f"{block}.s" for block in COMPUTE), relative_s=", other_J_tip.s, rest" if joints else "")
    return text + (JOINTED_CONNECTIONS.format(tip=tip) if joints else ""), tip, other


def run(bf, urdf, floating, folder, film):
    """Runs, compares and draws; returns the number of joints and of links whose inertia was mended, and whether forward dynamics
    could be computed. Raises with the reason."""
    model, recording = folder / "robot.yaml", folder / "run.mcap"
    joints = followers(urdf, None)[0]  # what has no elements is not recorded
    text, tip, other = fill(urdf, joints, floating)
    model.write_text(text)
    setting = ["--set", f"floating={str(floating).lower()}"]

    def reason(stderr):
        lines = [line for line in stderr.splitlines() if line.strip() and not line.startswith("bf: warning")]
        return next((line for line in lines if "rror" in line or "was not found" in line), lines[-1] if lines else "?")

    for forward in ("true", "false"):
        done = subprocess.run([bf, "run", model, "--quiet", "--record", recording, *setting, "--set", f"forward={forward}"],
                              capture_output=True, text=True)
        if "the mass matrix is singular" not in done.stderr:
            break
    if done.returncode != 0:
        raise RuntimeError(reason(done.stderr))
    exported = last_values(bf, recording)
    values = {signal: np.atleast_1d(value) for signal, value in exported.items()}
    values |= {signal.replace("_", ".", 1): value for signal, value in values.items()}  # com_com is com.com
    for signal in ("world.s", "s", "s_dot", "torque", "within", "ik.s"):
        values.setdefault(signal, np.zeros(0))
    figures = Oracle(urdf, floating).figures(values, tip, other)
    if joints and values["ik.status"] != 0:
        raise RuntimeError("inverse kinematics do not reach their target")
    for what, (theirs, tolerance) in figures.items():
        error = np.abs(np.reshape(values[what], theirs.shape) - theirs).max() / max(1, np.abs(theirs).max())
        if not error < tolerance:
            raise RuntimeError(f"{what} differs by {error:.1e}")
    mended = done.stderr.count("which no body has") + done.stderr.count("moves without")
    picture = folder / "picture.png"
    done = subprocess.run([bf, "film", recording, "--picture", picture, "--width", "160", "--height", "160"],
                          capture_output=True, text=True) if film else done
    if done.returncode != 0:
        raise RuntimeError("film: " + reason(done.stderr))
    return len(joints), mended, forward == "true"


def row(bf, urdf, name, folder):
    links = {l.get("name") for l in ET.parse(urdf).getroot().findall("link")}
    result, counts = [], None
    kinds = (False,) if "world" in links else (False, True)
    for floating in kinds:
        try:
            *counts, forward = run(bf, urdf, floating, folder, film=floating == kinds[-1])
            result.append("yes" if forward else "yes; M is singular")
        except Exception as error:  # any failure is a row
            result.append(re.sub(r"[^\s']*/", "", str(error)).replace("|", "/"))
    result += ["root is the world"] * (2 - len(result))
    joints, mended = counts or ("", "")
    return f"| {name} | {joints} | {mended or ''} | {result[0]} | {result[1]} |", any(text.startswith("yes") for text in result)


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
world and all rigid-body blocks, all joints but mimicking ones movable, 0.2 s long, and `bf film` draws a picture. At its end, at a state in
which nothing is zero,

- M, h, g, c = h - g, the centre of mass and its velocity, the centroidal momentum and its matrix, and pose, Jacobian and bias
  acceleration of a frame far from the root are those of iDynTree to 1e-9, and so are the pose and the Jacobian of that frame relative to
  another one, and inverse dynamics, M nu_dot + h;
- forward dynamics under torques and a wrench solve M nu_dot = [0; tau] + J' f - h to 1e-6, unless a joint moves no mass, which makes M singular;
- dM/dt is the difference quotient of iDynTree's M along the motion to 1e-6; the Coriolis matrix has C nu = c and C + C' = dM/dt;
- the bias of the centroidal momentum is the wrench c on the base, about the centre of mass;
- inverse kinematics find joint positions at which iDynTree has the frame where it is wanted, to 1e-5.

Links whose inertia no body can have are mended in the world, with a warning that names them.

| robot | joints | mended links | fixed base | floating base |
| --- | --- | --- | --- | --- |
"""

if __name__ == "__main__":
    main()
