"""A model with blocks of plugins and a robot as an FMU: the controller of the balancing iCub computes as an FMU what it
computes in the model, bit for bit, and runs where there is nothing else, several at once.

Usage: plugins.py BF EXAMPLES CC SOURCE
"""
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile

bf, examples, compiler, source = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import compare, read_recording, run  # noqa: E402

from law import write_law  # noqa: E402

STEP, STOP = 0.01, 1.5


def bare_root(folder, fmu, driver):
    """A root that holds the unpacked FMU, the program and the C library. A command in it, or beside it where the system
    allows no root of one's own."""
    root = folder / "root"
    needed = re.findall(r"(/\S+)", subprocess.run(["ldd", driver], capture_output=True, text=True, check=True).stdout)
    libraries = next(pathlib.Path(file).parent for file in needed if file.endswith("libc.so.6"))
    # With what the libraries of the FMU need of the C library besides.
    for file in {*needed, *(f"{libraries}/{name}" for name in ("libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1"))}:
        place = root / file[1:]
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, place)
    shutil.copy(driver, root / "bare")
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(root / "moved/fmu")
    chroot, unshare = (shutil.which(name, path="/usr/sbin:/usr/bin:/sbin:/bin") or name for name in ("chroot", "unshare"))
    for enter in ([chroot, root], [unshare, "--map-root-user", chroot, root]):
        if subprocess.run([*enter, "/bare"], capture_output=True, check=False).returncode == 2:  # its usage
            return [*enter, "/bare", "/moved/fmu"]
    return [driver, root / "moved/fmu"]


def said(*command):
    result = subprocess.run([bf, *map(str, command)], capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 1, result
    return result.stderr


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    write_law(folder, examples, STEP)
    (folder / "fmus").mkdir()
    model = pathlib.Path(examples, "icub_balancing/balancing.yaml")
    fmu = folder / "fmus/law.fmu"
    text = run(bf, "export-fmu", folder / "law.yaml", "-o", fmu, timeout=900).stdout
    assert "co-simulation and model exchange, " in text, text
    run(bf, "check-fmu", fmu)
    options = ["--quiet", "--set", f"stop={STOP}", "--set", "Push.force=40", "--set", "Push.at_y=0.5"]

    # In a loop with the world.
    run(bf, "run", model, *options, "--record", folder / "alone.mcap")
    run(bf, "run", folder / "balancing.yaml", "--plugin-path", folder / "fmus", *options, "--record", folder / "fmu.mcap",
        "--checkpoint-every", "0.5")
    recorded = read_recording(bf, folder / "alone.mcap")
    count, largest, first = compare(recorded, read_recording(bf, folder / "fmu.mcap"))
    assert count > 10000 and largest == 0, (count, largest, first)
    assert max(abs(x) for rows in recorded["controller.tau"].values() for x in rows[0]) > 1
    print(f"{count} numbers of the loop are the same")
    # Its state, with those of solvers inside of blocks, is in the checkpoints.
    run(bf, "replay", folder / "fmu.mcap", "--plugin-path", folder / "fmus", "--from", "0.7")

    # Where there is nothing else, moved, without an environment, two at once.
    driver = folder / "bare"
    run(*compiler.split(), f"-I{source}/fmi/include", f"{source}/tests/fmi/bare.c", "-o", driver, "-ldl", "-lm")
    with zipfile.ZipFile(fmu) as archive:
        description = archive.read("modelDescription.xml").decode()
        names = archive.namelist()
    assert not [n for n in names if n.startswith("sources/")], names
    assert "resources/share/iCub/robots/iCubGazeboV2_5/model.urdf" in names, names
    assert not [n for n in names if n.endswith(".stl")], names  # which only worlds read
    variables = []
    for head, rest in re.findall(r'<Float64 ([^>]*causality="(?:input|output)"[^>]*)(/>|>.*?</Float64>)', description):
        sizes = [int(n) for n in re.findall(r'<Dimension start="(\d+)"', rest)]
        size = 1
        for n in sizes:
            size *= n
        kind = "in" if 'causality="input"' in head else "out"
        variables.append((re.search(r'name="([^"]*)"', head)[1], kind, re.search(r'valueReference="(\d+)"', head)[1], size))
    assert sum(v[1] == "in" for v in variables) == 4 and len(variables) > 8, variables
    token = re.search(r'instantiationToken="([^"]*)"', description)[1]
    steps = 40
    command = bare_root(folder, fmu, driver)
    text = run("env", "-i", *command, "law", token, STEP, steps, *(f"{kind}:{r}:{size}" for _, kind, r, size in variables)).stdout
    rows = {}
    for line in text.splitlines():
        head, numbers = line.split()[:3], [float.fromhex(x) for x in line.split()[3:]]
        rows[tuple(map(int, head))] = numbers
    assert len(rows) == 2 * steps + steps - steps // 2, len(rows)
    for k in range(steps // 2, steps):
        assert rows[1, 0, k] == rows[0, 0, k], k  # a state is gone back to
    for instance in range(2):
        inputs = []
        at = 0
        places = {}
        for name, kind, _, size in variables:
            places[name] = (at, size)
            if kind == "in":
                inputs += [f"{name}[{i + 1}]" if size > 1 else name for i in range(size)]
            at += size
        count_of_inputs = len(inputs)
        (folder / "inputs.csv").write_text(",".join(["time", *inputs]) + "\n" + "".join(
            ",".join([repr(k * STEP), *map(repr, rows[0, instance, k][:count_of_inputs])]) + "\n" for k in range(steps)))
        run(bf, "run", folder / "law.yaml", "--quiet", "--set", f"stop={steps * STEP}", "--inputs", folder / "inputs.csv",
            "--record", folder / "law.mcap")
        alone = read_recording(bf, folder / "law.mcap")
        compared = 0
        for name, kind, _, size in variables:
            if kind == "in":
                continue
            at = places[name][0]
            for k in range(steps):
                values = alone[f"law.{name}"][round(k * STEP * 1e9)][-1]
                got = rows[0, instance, k][at:at + size]
                assert struct.pack(f"{size}d", *got) == struct.pack(f"{size}d", *values), (name, k, got, values)
                compared += size
        assert compared > 1000, compared
    print(f"two instances compute the same, started by {pathlib.Path(command[0]).name}")

    # What cannot be in an FMU is said by name.
    def refused(document, *options):
        (folder / "wrong.yaml").write_text("model: wrong\nstep: 0.01\n" + document)
        return said("export-fmu", folder / "wrong.yaml", "-o", folder / "wrong.fmu", "--plugin-path", folder / "fmus", *options)

    robot = ("plugins: [WholeBodyToolbox]\noutputs: [c]\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration}\n"
             "  s: {block: Constant, value: \"zeros(32, 1)\"}\n  w_H_b: {block: Constant, value: eye(4)}\n"
             "  com: {block: WholeBodyToolbox/ForwardKinematics, frame: com}\n"
             "connections: {s: com.s, w_H_b: com.w_H_b, com: c}\n")
    text = refused(robot, "--target", "aarch64")
    assert "blocks from plugins, which are binaries of this machine" in text and "leave --sources-only" in text, text
    elsewhere = tempfile.mkdtemp()
    shutil.copy(pathlib.Path(os.path.realpath(source), "examples/arm/arm.urdf"), elsewhere)
    text = refused(f"plugins: [WholeBodyToolbox]\nblocks:\n  robot: {{block: WholeBodyToolbox/Configuration, robot: {elsewhere}/arm.urdf}}\n")
    assert "cannot bundle" in text and "put it beside the model" in text, text
    # So are meshes of worlds, by whichever way a URDF names them.
    shutil.copytree(pathlib.Path(examples, "two_robots"), folder / "two")
    arm = folder / "two/arm.urdf"
    plain = arm.read_text()
    mesh = pathlib.Path(elsewhere, "part.obj")
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    for address, text in ((f"file://{mesh}", f"cannot bundle the mesh file://{mesh} of {arm}: it is looked for at that place alone; "
                                             "name it relative to the URDF"),
                          ("part.obj", f"cannot bundle {mesh}: it is neither in the model's folder")):
        arm.write_text(plain.replace('<robot name="arm">', f'<robot name="arm">\n  <mujoco><compiler meshdir="{elsewhere}"/></mujoco>').replace(
            '<link name="tip"/>', f'<link name="tip"><visual><geometry><mesh filename="{address}"/></geometry></visual></link>'))
        got = said("export-fmu", folder / "two/model.yaml", "-o", folder / "wrong.fmu")
        assert text in got, got
    shutil.rmtree(elsewhere)
    os.environ["CXX"] = "false"
    text = refused(robot)
    assert text.rstrip().endswith("set CXX to a compiler of C++20"), text
    del os.environ["CXX"]
    text = refused("plugins: [FMI]\nblocks:\n  f: {block: FMI/FMU, fmu: law.fmu, period: 0.01}\n")
    assert "the plugin FMI, which opens FMUs" in text, text
