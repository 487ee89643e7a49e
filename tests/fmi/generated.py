"""FMUs in generated programs and packages: the program is compiled, finds its FMU beside itself, and computes what `bf run` does.

Usage: generated.py BF EXAMPLES SOURCE CXX EIGEN LIBRARY...
"""
import pathlib
import re
import subprocess
import sys
import tempfile

bf, examples, source, compiler, eigen, *libraries = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_csv, read_recording, run  # noqa: E402

MODEL = """model: plant
step: 0.01
solver: rk4
inputs: [u]
outputs: [y]
blocks: {plant: {block: StateSpace, A: "[0 1; -40 -0.3]", B: "[0; 1]", C: "[1 0]", initial: [1, 0]}}
connections: {u: plant, plant: y}
"""
WRAPPER = """model: wrapped
plugins: [FMI]
step: 0.01
stop: 1
solver: rk4
blocks:
  sine: {block: Sine, frequency: 3}
  steps: {block: FMI/FMU, fmu: plant.fmu, period: 0.01}
  solved: {block: FMI/ModelExchange, fmu: plant.fmu}
connections: {sine: [steps.u, solved.u]}
record: [steps, solved]
"""

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    (folder / "fmus").mkdir()
    (folder / "plant.yaml").write_text(MODEL)
    (folder / "wrapped.yaml").write_text(WRAPPER)
    run(bf, "export-fmu", folder / "plant.yaml", "-o", folder / "fmus/plant.fmu")
    run(bf, "run", folder / "wrapped.yaml", "--plugin-path", folder / "fmus", "--quiet", "--record", folder / "run.mcap")
    expected = read_recording(bf, folder / "run.mcap")

    code, build = folder / "code", folder / "build"
    run(bf, "generate", folder / "wrapped.yaml", "-o", code, "--plugin-path", folder / "fmus")
    lists = (code / "CMakeLists.txt").read_text()
    assert re.search(r"add_custom_command\(TARGET run_wrapped POST_BUILD COMMAND \$\{CMAKE_COMMAND\} -E copy_directory", lists), lists
    build.mkdir()
    (code / "fmus").rename(build / "fmus")  # as that command does
    includes = [code, code / "include", *(f"{source}/{part}/include" for part in ("core", "base", "kernels"))]
    plugins = pathlib.Path(bf).parent.parent / "lib/blockfactory"
    run(*compiler.split(), "-std=c++20", "-O1", "-ffp-contract=off", f'-DBF_PLUGIN_FOLDER="{plugins}"',
        *(f"-I{i}" for i in includes), "-isystem", eigen, *(code / f"{n}.cpp" for n in ("wrapped", "wrapped_tables", "wrapped_hosted", "main")),
        "-o", build / "run_wrapped", *libraries, f"-Wl,-rpath,{pathlib.Path(libraries[0]).parent}", "-lpthread", timeout=600)
    run(build / "run_wrapped", "--csv", folder / "table.csv")
    got = read_csv(folder / "table.csv")
    count = 0
    for block, signal in (("steps", "steps.y"), ("solved", "solved.y")):
        its = got[signal if signal in got else block]
        for time, values in expected[block].items():
            assert its[time][-1] == values[-1], (block, time, its[time], values)
            count += 1
    assert count > 150, count
    (build / "fmus/plant.fmu").unlink()
    said = subprocess.run([build / "run_wrapped"], capture_output=True, text=True)
    assert said.returncode == 1 and "there is no FMU 'plant.fmu'" in said.stderr, said

    # A package brings it along, and a system as the model that it is.
    run(bf, "export-ssp", folder / "wrapped.yaml", "-o", folder / "system.ssp", "--plugin-path", folder / "fmus")
    for model, name in (("wrapped.yaml", "plant.fmu"), ("system.ssp", "resources/plant.fmu")):
        package = folder / "package"
        run(bf, "deploy", folder / model, "-o", package, "--plugin-path", folder / "fmus")
        assert (package / "lib/blockfactory" / name).exists()
        run(package / "bf", "run", next((package / "model").glob("*.yaml")), "--quiet", "--record", folder / "package.mcap")
        assert read_recording(bf, folder / "package.mcap") == expected, model
        run("rm", "-r", package)
    print(f"{count} numbers are the same in the generated program, and in packages")
