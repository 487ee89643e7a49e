"""The controller of the balancing iCub as a model of its own, and the example with an FMU of it.

Usage: law.py FOLDER EXAMPLES PERIOD
"""
import pathlib
import re
import shutil
import sys

INPUTS = ["s", "s_dot", "force_left", "force_right"]
OUTPUTS = ["com", "com_reference", "wrenches", "tau", "violation", "qp_status", "state"]


def line(text, block):
    """A block of one line."""
    return re.search(rf"^  {block}: {{.*}}\n", text, re.MULTILINE)[0]


def write_law(folder, examples, period):
    """law.yaml: measurements as inputs, torques as outputs, with the parts, variables and robot of the example.
    balancing.yaml: the example with FMI/FMU, law.fmu, in place of them."""
    folder = pathlib.Path(folder)
    for file in pathlib.Path(examples, "icub_balancing").glob("*.yaml"):
        shutil.copy(file, folder)
    root, controller = (folder / "balancing.yaml").read_text(), (folder / "controller.yaml").read_text()
    variables = re.search(r"^variables:.*?(?=^blocks:)", root, re.MULTILINE | re.DOTALL)[0]
    robot = re.search(r"^  robot:\n(?:   .*\n)+", root, re.MULTILINE)[0]
    part = controller
    for block in [*INPUTS, "actuators"]:
        part = part.replace(line(controller, block), "")
    part = part.replace("model: controller", f"model: part\ninputs: [{', '.join(INPUTS)}]")
    part = part.replace("limited: [actuators.u, tau]", "limited: tau")
    (folder / "part.yaml").write_text(part)
    wires = "".join(f"  {name}: law.{name}\n" for name in INPUTS)
    (folder / "law.yaml").write_text(
        f"model: law\nplugins: [WholeBodyToolbox]\nstep: {period}\nstop: 20\n"
        f"inputs: {{s: {{shape: n}}, s_dot: {{shape: n}}, force_left: {{}}, force_right: {{}}}}\n"
        f"outputs: [{', '.join(OUTPUTS)}]\n{variables}blocks:\n{robot}  law: {{file: part.yaml}}\nconnections:\n{wires}"
        + "".join(f"  law.{name}: {name}\n" for name in OUTPUTS)
        + f"record: [{', '.join('law.' + name for name in OUTPUTS)}]\n")
    (folder / "controller.yaml").write_text(
        f"model: controller\noutputs: [{', '.join(OUTPUTS)}]\nblocks:\n"
        + "".join(line(controller, block) for block in [*INPUTS, "actuators"])
        + f"  law: {{block: FMI/FMU, fmu: law.fmu, period: T_control}}\nconnections:\n{wires}"
        + "".join(f"  law.{name}: {name}\n" for name in OUTPUTS if name != "tau") + "  law.tau: [actuators.u, tau]\n")
    (folder / "balancing.yaml").write_text(root.replace("plugins: [", "plugins: [FMI, "))


if __name__ == "__main__":
    write_law(*sys.argv[1:])
