#!/usr/bin/env python3
"""Times the same models in BlockFactory and in other block-diagram tools, one after another on this machine.

Usage: run.py [--bf BF] [--folder FOLDER] [PEER...]. Installs each peer into FOLDER (build/peers) on its first use, pinned,
and touches nothing else; a peer that cannot be installed is skipped with the reason. Prints a table and writes
FOLDER.json: [{peer, case, step_ns, startup_s, compile_s, check}]. All times are CPU times.
"""
import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE))
from common import CARTPOLE, CHAIN  # noqa: E402

CASES = ("chain", "chain23", "cartpole")
BLOCKS = 2 * CHAIN["pairs"] + CHAIN["delays"]
# Steps of the cart-pole, with repetitions, come to 100 s at most: later it rests, and its squares are denormal numbers,
# with which arithmetic takes twice the time.
REPEATS = 5
# Last sum of the chain on its plateau, and the pole's angle at check_time by an eighth-order method of SciPy.
EXPECTED = {"chain": 993.278888040133, "chain23": 993.278888040133, "cartpole": -0.0241515243943}


class Skipped(Exception):
    """Why a peer or a case is not measured."""


def call(command, **options):
    """Standard output of a command; what it says of an error is the reason to skip."""
    try:
        result = subprocess.run([str(part) for part in command], capture_output=True, text=True, stdin=subprocess.DEVNULL,
                                **options)
    except OSError as error:
        raise Skipped(f"{error.filename}: {error.strerror}") from None
    if result.returncode != 0:
        lines = (result.stderr.strip() or result.stdout.strip() or f"exit code {result.returncode}").splitlines()
        raise Skipped(next((line for line in lines if "error" in line.lower()), lines[0]).strip())
    return result.stdout


def last_json(text):
    return json.loads([line for line in text.splitlines() if line.startswith("{")][-1])


def processor_time(command, **options):
    """CPU seconds of a command, and its output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = call(command, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, output


def difference_of_runs(long, short, steps):
    """ns per step of a program, and seconds of the short run: the fastest of each."""
    fast = [min(processor_time(command)[0] for _ in range(REPEATS)) for command in (long, short)]
    return (fast[0] - fast[1]) / steps * 1e9, fast[1]


class BlockFactory:
    """`bf run` on the diagram as a file. Start-up is all of a run that makes one step."""

    name, key = "BlockFactory", "blockfactory"
    steps = {"chain": 200_000, "chain23": 50_000, "cartpole": 100_000}

    def __init__(self, options):
        self.bf, self.folder = options.bf, options.folder / "blockfactory"

    def install(self):
        if not self.bf.exists():
            raise Skipped(f"{self.bf} does not exist: 'make build' makes it")
        self.folder.mkdir(parents=True, exist_ok=True)

    def program(self, case, model):
        """The command that runs a model, and the seconds to compile it."""
        return [self.bf, "run", model, "--quiet", "--json"], 0.0

    def check(self, output):
        return json.loads(output)["checks"]["check"]

    def measure(self, case):
        if case == "cartpole":
            step, check_steps, parts = CARTPOLE["step"], 1 + round(CARTPOLE["check_time"] / CARTPOLE["step"]), self.cart_pole()
        else:
            step, check_steps, parts = 1 / 1024, CHAIN["check_steps"], self.chain(case)
        command, compile_s = self.program(case, self.write(case, step, *parts))

        def run_of(steps):
            return [*command, "--stop", repr(steps * step)]

        check = self.check(call(run_of(check_steps)))
        steps = self.steps[case]
        step_ns, startup = difference_of_runs(run_of(steps + 1), run_of(1), steps)
        return {"step_ns": step_ns, "startup_s": startup, "compile_s": compile_s, "check": check}

    def write(self, case, step, blocks, connections):
        file = self.folder / f"{case}.yaml"
        indented = "".join(f"  {line}\n" for line in [*blocks, "", *connections]).replace("  \n", "connections:\n")
        file.write_text(f"model: {case}\nstep: {step}\nstop: 1\nblocks:\n{indented}")
        return file

    def chain(self, case):
        width, pairs, delays = 23 if case == "chain23" else 1, CHAIN["pairs"], CHAIN["delays"]
        blocks = [f'one: {{block: Constant, value: "{CHAIN["constant"]}*ones({width}, 1)"}}']
        connections, last = ["one: [" + ", ".join(f"sum{i}.u2" for i in range(pairs)) + "]"], f"delay{delays - 1}"
        for i in range(pairs):
            blocks += [f"gain{i}: {{block: Gain, K: {CHAIN['gain']}}}", f"sum{i}: {{block: Sum}}"]
            connections += [f"{last}: gain{i}", f"gain{i}: sum{i}.u1"]
            last = f"sum{i}"
        connections.append(f"{last}: [delay0, first]")
        connections += [f"delay{i}: delay{i + 1}" for i in range(delays - 1)]
        blocks += [f"delay{i}: {{block: UnitDelay}}" for i in range(delays)]
        blocks += ["first: {block: Selector, indices: 1}", "check: {block: Check, kind: final}"]
        return blocks, [*connections, "first: check"]

    def cart_pole(self):
        c = CARTPOLE
        plant = os.path.relpath(ROOT / "examples/cart_pole/plant.yaml", self.folder)
        values = f'M: {c["cart"]}, m: {c["pole"]}, l: {c["length"]}, g: {c["gravity"]}, start: "[0; {c["theta"]}; 0; 0]"'
        return [
            f"plant: {{file: {plant}, with: {{{values}}}}}",
            f'regulator: {{block: Gain, period: {c["period"]}, multiplication: K*u, K: "{[-k for k in c["K"]]}"}}',
            "angle: {block: Selector, indices: 2}",
            "check: {block: Check, kind: final}",
        ], ["plant: [regulator, angle]", "regulator: plant", "angle: check"]


class Generated(BlockFactory):
    """The C++ that `bf generate` writes for the same diagram, compiled as its CMakeLists.txt does."""

    name, key = "BlockFactory, generated C++", "generated"
    steps = {"chain": 500_000, "chain23": 100_000, "cartpole": 100_000}

    def program(self, case, model):
        project = self.folder / f"{case}_project"
        shutil.rmtree(project, ignore_errors=True)
        commands = [self.bf, "generate", model, "-o", project], ["cmake", "-S", project, "-B", project / "build"], \
            ["cmake", "--build", project / "build"]
        return [project / f"build/run_{case}"], sum(processor_time(command)[0] for command in commands)

    def check(self, output):
        return float(output.split("check = ")[1].split()[0])


class PythonPeer:
    """A package in its own virtual environment, measured by its script."""

    def __init__(self, options):
        self.folder = options.folder / self.key

    def install(self):
        done = self.folder / "installed"
        requirements = HERE / f"{self.key}.txt"
        if done.exists() and done.read_text() == requirements.read_text():
            return
        print(f"{self.name}: installing {requirements.name} into {self.folder}", file=sys.stderr)
        call([sys.executable, "-m", "venv", "--clear", self.folder])
        call([self.folder / "bin/pip", "install", "--quiet", "--no-deps", "-r", requirements])
        done.write_text(requirements.read_text())

    def measure(self, case):
        return last_json(call([self.folder / "bin/python", HERE / f"{self.key}_peer.py", case, self.steps[case], REPEATS],
                              env={**os.environ, "OMP_NUM_THREADS": "1"}))


class Drake(PythonPeer):
    name, key = "Drake", "drake"
    steps = {"chain": 1_000, "chain23": 1_000, "cartpole": 20_000}


class PathSim(PythonPeer):
    name, key = "PathSim", "pathsim"
    steps = {"chain": 200, "chain23": 100, "cartpole": 3_000}


class Jaxonomy(PythonPeer):
    name, key = "Jaxonomy", "jaxonomy"
    steps = {"chain": 50_000, "chain23": 50_000, "cartpole": 20_000}


class Xcos:
    """Scilab's packages of Debian, unpacked into a folder of their own."""

    name, key = "Scilab/Xcos", "xcos"
    steps = {"chain": 10_000, "chain23": 5_000, "cartpole": 100_000}

    def __init__(self, options):
        self.folder = options.folder / "xcos"

    def install(self):
        done, archives = self.folder / "installed", self.folder / "archives"
        if done.exists():
            return
        print(f"{self.name}: downloading into {self.folder}", file=sys.stderr)
        (archives / "partial").mkdir(parents=True, exist_ok=True)
        call(["apt-get", "install", "-y", "-qq", "--download-only", "--no-install-recommends", "-o", "Debug::NoLocking=1",
              "-o", f"Dir::Cache::archives={archives}", *(HERE / "xcos.txt").read_text().split()])
        for package in archives.glob("*.deb"):
            call(["dpkg", "-x", package, self.folder / "root"])
        done.touch()

    @property
    def root(self):
        """Where the packages are: unpacked, or installed before on this machine."""
        unpacked = self.folder / "root"
        return unpacked if (unpacked / "usr/bin/scilab-cli-bin").exists() else Path("/")

    def measure(self, case):
        chain = case != "cartpole"
        c = CHAIN if chain else CARTPOLE
        numbers = {"STEPS": self.steps[case], "REPEATS": REPEATS, "WIDTH": 23 if case == "chain23" else 1}
        if chain:
            numbers |= {"H": "1/1024", "CHECK_STEPS": c["check_steps"], "PAIRS": c["pairs"], "DELAYS": c["delays"],
                        "GAIN": c["gain"], "CONSTANT": c["constant"]}
        else:
            # Half a step more, for the script ends half a step early.
            numbers |= {"H": c["step"], "CHECK_STEPS": c["check_time"] / c["step"] + 0.5, "CART": c["cart"], "POLE": c["pole"],
                        "LENGTH": c["length"], "GRAVITY": c["gravity"], "THETA": c["theta"], "PERIOD": c["period"], "K": c["K"]}
        script = self.folder / f"{case}.sce"
        script.write_text(f'CASE = "{case}";\n' + "".join(f"{name} = {value};\n" for name, value in numbers.items()) +
                          (HERE / "xcos.sce").read_text())
        unpacked = [self.folder / "root/lib", self.folder / "root/usr/lib"]
        libraries = sorted({str(file.parent) for folder in unpacked for file in folder.rglob("*.so*")})
        output = call([self.root / "usr/bin/scilab-cli-bin", "-nb", "-quit", "-f", script],
                      env={**os.environ, "SCI": str(self.root / "usr/share/scilab"), "LD_LIBRARY_PATH": ":".join(libraries)})
        try:
            return last_json(output)
        except IndexError:
            raise Skipped(output.strip().splitlines()[-1]) from None


class Copper:
    """A crate per case: Copper compiles its graph. Its tasks are in Rust, and so is the plant with its solver."""

    name, key = "Copper", "copper"
    steps = {"chain": 20_000, "chain23": 10_000, "cartpole": 2_000}  # iterations

    def __init__(self, options):
        self.folder = options.folder / "copper"

    def install(self):
        if not shutil.which("cargo"):
            raise Skipped("cargo is not installed")
        self.cargo("fetch", self.crate("cartpole"))

    def cargo(self, verb, crate, *options):
        """CPU seconds of cargo, which keeps everything it fetches and builds in the peer's folder."""
        environment = {"CARGO_HOME": str(self.folder / "cargo"), "CARGO_TARGET_DIR": str(self.folder / "target")}
        return processor_time(["cargo", verb, "--locked", "--manifest-path", crate / "Cargo.toml", *options],
                              env={**os.environ, **environment})[0]

    def crate(self, case):
        crate = self.folder / "crate"
        shutil.copytree(HERE / "copper", crate, dirs_exist_ok=True)
        c = CARTPOLE
        (crate / "src/case.rs").write_text(f"""pub const WIDTH: usize = {23 if case == "chain23" else 1};
pub const MASSES: [f64; 2] = [{float(c["cart"])}, {float(c["pole"])}];
pub const LENGTH: f64 = {float(c["length"])};
pub const GRAVITY: f64 = {float(c["gravity"])};
pub const THETA: f64 = {float(c["theta"])};
pub const STEP: f64 = {float(c["step"])};
pub const HORIZON: usize = {round(c["period"] / c["step"])};
pub const K: [f64; 4] = {[float(k) for k in c["K"]]};
""")
        tasks, links = [], []

        def task(name, kind, config=""):
            tasks.append(f'(id: "{name}", type: "tasks::{kind}"{config}),')

        def link(source, to, message="tasks::Signal"):
            links.append(f'(src: "{source}", dst: "{to}", msg: "{message}"),')

        if case == "cartpole":
            for name in ("Plant", "Regulator", "Actuator"):
                task(name.lower(), name)
            link("plant", "regulator", "[f64; 4]")
            link("regulator", "actuator", "f64")
        else:
            task("one", "Constant", f', config: {{"value": {float(CHAIN["constant"])}}}')
            task("back", "Back")
            last = "back"
            for i in range(CHAIN["pairs"]):
                task(f"gain{i}", "Gain", f', config: {{"k": {CHAIN["gain"]}}}')
                task(f"sum{i}", "Sum")
                link(last, f"gain{i}")
                link(f"gain{i}", f"sum{i}")
                link("one", f"sum{i}")
                last = f"sum{i}"
            total = last
            for i in range(CHAIN["delays"] - 1):
                task(f"delay{i}", "Delay")
                link(last, f"delay{i}")
                last = f"delay{i}"
            task("last_delay", "LastDelay")
            link(last, "last_delay")
            link(total, "last_delay")
        (crate / "case.ron").write_text("(tasks: [\n" + "\n".join(tasks) + "\n], cnx: [\n" + "\n".join(links) +
                                        "\n], logging: (enable_task_logging: false, enable_keyframe_logging: false))\n")
        return crate

    def measure(self, case):
        # The dependencies are compiled before the clock starts.
        self.cargo("build", self.crate("cartpole"), "--release")
        crate = self.crate(case)
        (crate / "src/main.rs").touch()
        compiled = self.cargo("build", crate, "--release")
        substeps = round(CARTPOLE["period"] / CARTPOLE["step"]) if case == "cartpole" else 1
        check = CHAIN["check_steps"] if substeps == 1 else round(CARTPOLE["check_time"] / CARTPOLE["period"]) + 1
        result = last_json(call([self.folder / "target/release/copper_peer", self.steps[case], REPEATS, check]))
        result["step_ns"] /= substeps
        return {**result, "compile_s": compiled}


PEERS = (BlockFactory, Generated, Jaxonomy, Copper, Xcos, Drake, PathSim)


def main():
    names = {peer.key: peer for peer in PEERS}
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("peers", nargs="*", metavar="PEER", help="all if none is given: " + ", ".join(names))
    parser.add_argument("--bf", type=Path, default=ROOT / "build/bin/bf", help="our program")
    parser.add_argument("--folder", type=Path, default=ROOT / "build/peers", help="where peers are installed")
    options = parser.parse_args()
    options.bf, options.folder = options.bf.resolve(), options.folder.resolve()
    unknown = [name for name in options.peers if name not in names]
    if unknown:
        parser.error(f"there is no peer '{unknown[0]}'; there are {', '.join(names)}")
    options.folder.mkdir(parents=True, exist_ok=True)

    results = options.folder.with_suffix(".json")
    measured = {}
    print("| peer | case | ns per step | ns per block and step | start-up, s | compile, s | check |")
    print("| --- | --- | ---: | ---: | ---: | ---: | --- |", flush=True)
    for kind in [names[name] for name in options.peers] or PEERS:
        peer = kind(options)
        measured[peer.name] = []
        try:
            peer.install()
        except Skipped as reason:
            print(f"| {peer.name} | | skipped: {reason} |", flush=True)
            continue
        for case in CASES:
            try:
                row = {"peer": peer.name, "case": case, **peer.measure(case)}
            except Skipped as reason:
                print(f"| {peer.name} | {case} | skipped: {reason} |", flush=True)
                continue
            per_block = f"{row['step_ns'] / BLOCKS:.3g}" if case != "cartpole" else ""
            agreement = "same" if abs(row["check"] - EXPECTED[case]) < 1e-8 else f"WRONG: {row['check']}"
            print(f"| {peer.name} | {case} | {row['step_ns']:.4g} | {per_block} | {row['startup_s']:.2f} | "
                  f"{row['compile_s']:.1f} | {agreement} |", flush=True)
            measured[peer.name].append(row)
    others = json.loads(results.read_text()) if results.exists() else []
    rows = [row for row in others if row["peer"] not in measured] + sum(measured.values(), [])
    results.write_text(json.dumps(rows, indent=2) + "\n")
    print(f"\nLoad of the last minute: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors.")


if __name__ == "__main__":
    main()
