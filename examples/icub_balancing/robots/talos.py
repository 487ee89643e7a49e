"""Writes Talos with the names that the diagrams of iCubs have for frames and sensors, and runs one of them.

Usage: talos.py FOLDER URDF [BF MODEL PARAMETERS SCENARIO...]. FOLDER is what `make robots` installed, URDF is written. The model is
run with the file of PARAMETERS in each scenario, and every check must pass.
"""
import json
import pathlib
import subprocess
import sys
import xml.etree.ElementTree as ET

# Name in the diagram -> link of Talos, and where in its frame, m and rad. Its force/torque sensors are in the ankles, where the description
# has none; like those of an iCub they have z down.
FRAMES = {
    "root_link": ("base_link", "0 0 0", "0 0 0"),
    "l_foot_ft_sensor": ("leg_left_6_link", "0 0 0", "3.141592653589793 0 0"),
    "l_sole": ("l_foot_ft_sensor", "0 0 0.107", "-3.141592653589793 0 0"),
    "r_foot_ft_sensor": ("leg_right_6_link", "0 0 0", "3.141592653589793 0 0"),
    "r_sole": ("r_foot_ft_sensor", "0 0 0.107", "-3.141592653589793 0 0"),
}


def inertial(link, part, rpy=None):
    """Part of a link's inertia; seen from a frame at the same origin that is turned by `rpy` = [pi 0 0]."""
    whole = link.find("inertial")
    result = ET.Element("inertial")
    x, y, z = map(float, whole.find("origin").get("xyz").split())
    ET.SubElement(result, "origin", xyz=f"{x} {-y} {-z}" if rpy else f"{x} {y} {z}", rpy=rpy or "0 0 0")
    ET.SubElement(result, "mass", value=str(part * float(whole.find("mass").get("value"))))
    ET.SubElement(result, "inertia", {name: str(part * float(value)) for name, value in whole.find("inertia").items()})
    return result


def write(folder, urdf):
    source = folder.absolute() / "cmeel.prefix/share/example-robot-data/robots/talos_data/robots/talos_reduced.urdf"
    if not source.is_file():
        print(f"{source} is missing: make robots")
        sys.exit(77)
    tree = ET.parse(source)
    robot = tree.getroot()
    next(link for link in robot.findall("link") if link.get("name") == "torso_2_link").set("name", "chest")
    for end in robot.iter():
        if end.get("link") == "torso_2_link":
            end.set("link", "chest")
    for name, (parent, xyz, rpy) in FRAMES.items():
        ET.SubElement(robot, "link", name=name)
        joint = ET.SubElement(robot, "joint", name=name, type="fixed")
        ET.SubElement(joint, "origin", xyz=xyz, rpy=rpy)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=name)
    # What is above the sensor keeps a sixteenth of mass and inertia, so that the whole foot is what it was.
    links = {link.get("name"): link for link in robot.findall("link")}
    for side, long in (("l", "left"), ("r", "right")):
        ankle = links[f"leg_{long}_6_link"]
        links[f"{side}_foot_ft_sensor"].append(inertial(ankle, 15 / 16, "3.141592653589793 0 0"))
        rest = inertial(ankle, 1 / 16)
        ankle.remove(ankle.find("inertial"))
        ankle.append(rest)
    for mesh in robot.iter("mesh"):
        mesh.set("filename", mesh.get("filename").replace("package:/", str(folder.absolute() / "cmeel.prefix/share")))
    tree.write(urdf)


folder, urdf, *program = sys.argv[1:]
write(pathlib.Path(folder), urdf)
if program:
    bf, model, parameters, *scenarios = program
    for scenario in scenarios:
        done = subprocess.run([bf, "run", model, "--quiet", "--json", "--set", f"robot.robot='{urdf}'", "--set", f"scenario={scenario}",
                               "--params", parameters], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        checks = json.loads(done.stdout)["checks"]
        assert checks["stood"] is True and not [name for name, value in checks.items() if value is False], checks
