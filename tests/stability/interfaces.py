#!/usr/bin/env python3
"""Interfaces that others rely on stay as their versions say (docs/concepts/stability.md).

interfaces.py check BUILD     compares them with what facts/ has of the last release
interfaces.py exact BUILD     the same, and facts/ must have all that is new, too: before a release
interfaces.py write BUILD     writes facts/ anew; refused where something is gone whose version was not raised
    --unreleased              also then: what is gone was in no release
    --only NAME                   that interface alone; may be repeated

An interface is a list of facts, a line each. A line that is gone or reads otherwise breaks what others have; a new one does
not, but for those that begin with `must`. Needs Debian's python3-clang-14; without it exit code 77.
"""

import argparse
import ast
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# What an installation has and people write against; the rest of its headers is for generated code.
API = ["base", "core", "model", "formats/yaml", "library", "engine", "analysis", "codegen", "realtime", "run", "recording",
       "recording/plot"]
ROBOTS = ["bf/toolbox/robot_device.hpp", "bf/physics/joint_control.hpp", "bf/middleware/exchange.hpp", "bf/middleware/clock.hpp"]
PLUGINS = ["WholeBodyToolbox", "WholeBodyCameras", "SharedMemory", "Udp", "FMI"]

# One of each kind of signal.
RECORDED = """model: recorded
step: 0.5
stop: 1
blocks:
  scalar: {block: Constant, value: 1.5}
  vector: {block: Constant, value: "[1; 2]"}
  matrix: {block: Constant, value: "[1 2; 3 4]"}
  single: {block: Constant, value: single(0.5)}
  count: {block: Constant, value: int32(7)}
  flag: {block: Constant, value: true}
  sum: {block: DiscreteIntegrator}
connections: {scalar: sum}
record: [scalar, vector, matrix, single, count, flag, sum]
"""


class Interfaces:
    def __init__(self, source, build):
        self.source, self.build = source, build
        self.parsed, self.found_facts = None, {}

    def facts(self, name):
        if name not in self.found_facts:
            self.found_facts[name] = getattr(self, name)()
        return self.found_facts[name]

    def text(self, file):
        return (self.source / file).read_text()

    def found(self, file, pattern):
        return re.search(pattern, self.text(file))[1]

    def bf(self, *arguments):
        environment = {name: value for name, value in os.environ.items() if name != "BLOCKFACTORY_PLUGIN_PATH"}
        return subprocess.run([self.build / "bin/bf", *arguments], check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout

    def release(self):
        return self.found("CMakeLists.txt", r"project\(BlockFactory VERSION ([\d.]+)")

    def unit(self):
        """All headers at once, as most include the others."""
        import cxx

        if self.parsed is None:
            folders = [self.source / folder / "include" for folder in API]
            headers = sorted(str(file.relative_to(folder)) for folder in folders for file in folder.rglob("*")
                             if file.suffix in (".hpp", ".h") and file.name != "web_socket.hpp")
            others = ["kernels", "program", "elaborate", "matlab", "toolbox", "physics", "middleware", "middleware/udp", "middleware/shared_memory"]
            self.parsed = cxx.parse(
                [*headers, *ROBOTS, "packet.hpp", "robot_file.hpp"],
                [*folders, *(self.source / folder / "include" for folder in others), self.source / "middleware/udp/src",
                 self.source / "middleware/shared_memory/src"])
        return self.parsed

    def cpp(self):
        import cxx

        folders = [self.source / folder / "include" for folder in API]
        robots = [self.source / header.split("/")[1] / "include" / header for header in ROBOTS]
        return self.release(), cxx.declarations(self.unit(), [*folders, *robots])

    def plugin(self):
        import cxx

        lines = cxx.layouts(self.unit(), [self.source / "core/include"])
        lines.add("entry " + self.found("core/include/bf/core/registry.hpp", r'plugin_symbol = "(\w+)"'))
        return self.found("core/include/bf/core/registry.hpp", r"uint64_t number = (\d+);"), lines

    def run_c(self):
        import cxx

        header = "run/include/bf/run/run_c.h"
        return self.found(header, r"bf_run_v(\d+)_function"), cxx.layouts(self.unit(), [self.source / header])

    def udp(self):
        import cxx

        folder = self.source / "middleware/udp/src"
        lines = cxx.layouts(self.unit(), [folder], {"bf::udp::Head", "bf::udp::Kind"})
        lines |= {f"{name} = {self.found('middleware/udp/src/packet.hpp', name + r' = ([^,;]+)')}"
                  for name in ("head_bytes", "code_bytes", "most_bytes")}
        return self.found("middleware/udp/src/packet.hpp", r'"BFU(\d)"'), lines

    def shared_memory(self):
        import cxx

        folders = [self.source / "middleware/shared_memory/src", self.source / "middleware/include"]
        names = {"bf::shared_memory::RobotFile::Header", "bf::shared_memory::RobotFile::Finder", "bf::middleware::Bell",
                 "bf::middleware::Exchange::Header", "bf::middleware::Exchange::Turn"}
        return self.found("middleware/shared_memory/src/robot_file.hpp", r'"BFR(\d)"'), cxx.layouts(self.unit(), folders, names)

    def model(self):
        """The keys of model files, and what blocks are given and have."""
        lines = set()

        def schema(node, path):
            if isinstance(node, dict):
                for name, part in node.items():
                    if name in ("description", "title", "$schema"):
                        continue
                    if name == "properties":
                        for key, value in part.items():
                            must = key in node.get("required", [])
                            lines.add(f"{'must ' if must else ''}key {path}/{key}")
                            schema(value, f"{path}/{key}")
                    elif name != "required":
                        schema(part, f"{path}/{name}")
            elif isinstance(node, list):
                for part in node:
                    schema(part, path)
            else:
                lines.add(f"rule {path} = {json.dumps(node)}")

        schema(json.loads(self.text("formats/yaml/model.schema.json")), "")
        for library in ["standard", *PLUGINS]:
            described = json.loads(self.bf("describe", "--json", library))
            for block in described["blocks"] if isinstance(described, dict) else described:
                name = f"{library}/{block['name']}"
                lines.add(f"block {name}")
                for argument in block.get("arguments", []):
                    of = f"argument {name}.{argument['name']}"
                    lines.add(f"{'' if 'default' in argument else 'must '}{of}: {argument['type']}")
                    lines.add(f"{of} default {argument.get('default')}")
                    lines.update(f"{of} choice {choice}" for choice in argument.get("choices", []))
                for quantity in block.get("quantities", []):
                    about = ", ".join(str(quantity[key]) for key in ("size", "type", "unit", "initial") if key in quantity)
                    lines.add(f"{quantity['role']} {name}.{quantity['name']}: {about}")
        return self.release(), lines

    def recording(self):
        from mcap.reader import make_reader

        lines = set()
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "recorded.yaml").write_text(RECORDED)
            self.bf("run", str(folder / "recorded.yaml"), "--quiet", "--set", "sum.initial=2", "--record", str(folder / "r.mcap"))
            with (folder / "r.mcap").open("rb") as file:
                reader = make_reader(file)
                summary = reader.get_summary()
                lines.add(f"library {reader.get_header().library}")
                for schema in summary.schemas.values():
                    lines.add(f"schema {schema.name} {schema.encoding}: {'; '.join(schema.data.decode().split(chr(10)))}")
                for channel in summary.channels.values():
                    about = {key: value for key, value in channel.metadata.items() if key in ("type", "rows", "cols", "matrix", "held")}
                    lines.add(f"channel {channel.topic} {channel.message_encoding} {summary.schemas[channel.schema_id].name} {about}")
                    lines.update(f"channel has {key}" for key in channel.metadata)
                for record in reader.iter_metadata():
                    lines.update(f"metadata {record.name} {key}" for key in (record.metadata if record.name in ("recording", "run") else [""]))
                for attachment in reader.iter_attachments():
                    lines.add(f"attachment {attachment.name} {attachment.media_type}")
        return self.release(), lines

    def page(self):
        """What `bf edit` and a page say to each other."""
        lines, owner = set(), ""
        for line in self.bf("edit", "--protocol").splitlines():
            opened = re.match(r"export (?:interface|type) (\w+)(.*)", line)
            member = re.match(r"\s+(\w+\??: .*);", line)
            if opened:
                owner = opened[1]
                lines.add(f"type {owner}{opened[2].rstrip(' {')}")
            elif member:
                lines.add(f"{owner}.{member[1]}")
        return self.found("editor/service/include/bf/service/protocol.hpp", r"protocol_version = (\d+)"), lines

    def python(self):
        """Of the package: what its __all__, `operations` and `errors` have."""
        folder = self.source / "python/blockfactory"
        modules = {file.stem: ast.parse(file.read_text()) for file in folder.glob("*.py*") if file.suffix in (".py", ".pyi")}
        public = ast.literal_eval(next(node.value for node in modules["__init__"].body
                                       if isinstance(node, ast.Assign) and node.targets[0].id == "__all__"))
        lines = {f"name {name}" for name in public}

        def function(node, name):
            arguments = node.args
            positional = [*arguments.posonlyargs, *arguments.args]
            defaults = [None] * (len(positional) - len(arguments.defaults)) + arguments.defaults
            kinds = {id(argument): "by position" for argument in arguments.posonlyargs}
            kinds |= {id(argument): "by name" for argument in arguments.kwonlyargs}
            number = itertools.count()
            for argument, default in [*zip(positional, defaults), *zip(arguments.kwonlyargs, arguments.kw_defaults)]:
                if argument.arg in ("self", "cls"):
                    continue
                how = kinds.get(id(argument)) or f"number {next(number)}"
                kind = f": {ast.unparse(argument.annotation)}" if argument.annotation else ""
                lines.add(f"{'must ' if default is None else ''}argument {name}({argument.arg}){kind}, {how}")
                if default is not None:
                    lines.add(f"default {name}({argument.arg}) = {ast.unparse(default)}")
            for more in filter(None, [arguments.vararg, arguments.kwarg]):
                lines.add(f"argument {name}(*{more.arg})")
            kind = " ".join([*map(ast.unparse, node.decorator_list), "function"])
            lines.add(f"{kind} {name} -> {ast.unparse(node.returns) if node.returns else ''}")

        def is_public(name):
            return not name.startswith("_") or name.startswith("__") and name.endswith("__") and name != "__slots__"

        def members(node, name):
            lines.add(f"class {name}({', '.join(ast.unparse(base) for base in node.bases)})")
            for part in node.body:
                if isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef)) and is_public(part.name):
                    function(part, f"{name}.{part.name}")
                elif isinstance(part, ast.AnnAssign) and is_public(part.target.id):
                    lines.add(f"member {name}.{part.target.id}: {ast.unparse(part.annotation)}")
                if isinstance(part, ast.FunctionDef) and part.name == "__init__":
                    for set_there in ast.walk(part):
                        target = getattr(set_there, "target", None)
                        if isinstance(set_there, ast.AnnAssign) and isinstance(target, ast.Attribute) and is_public(target.attr):
                            lines.add(f"member {name}.{target.attr}: {ast.unparse(set_there.annotation)}")

        for module, tree in modules.items():
            whole = module in ("operations", "errors")
            for node in tree.body:
                if not isinstance(node, (ast.ClassDef, ast.FunctionDef)) or not (whole and is_public(node.name) or node.name in public):
                    continue
                name = f"{module}.{node.name}" if whole else node.name
                members(node, name) if isinstance(node, ast.ClassDef) else function(node, name)
        return self.release(), lines


NAMES = ["cpp", "plugin", "run_c", "model", "recording", "page", "udp", "shared_memory", "python"]


def is_raised(old, new):
    """As semantic versioning has it: the first number that is not zero counts."""
    numbers = [[int(part) for part in version.split(".")] for version in (old, new)]
    significant = next((i for i, part in enumerate(numbers[0]) if part), len(numbers[0]) - 1)
    return numbers[1][: significant + 1] > numbers[0][: significant + 1]


def read(file):
    if not file.exists():
        return "0", set()
    version, *lines = file.read_text().splitlines()
    return version.removeprefix("version "), set(lines)


def run(interfaces, what, facts, names=NAMES, unreleased=False):
    """Are they right? Prints what is wrong."""
    is_right = True
    for name in names:
        file = facts / f"{name}.txt"
        before, old = read(file)
        version, new = interfaces.facts(name)
        if not new:
            raise SystemExit(f"{name}: no fact was found, so the check itself is broken")
        lost = sorted(old - new) + sorted(line for line in new - old if old and line.startswith("must "))
        if lost and not is_raised(before, version) and not (unreleased and what == "write"):
            is_right = False
            print(f"{name}: what others rely on has changed, and the version is {version} as before:")
            print("".join(f"  - {line}\n" for line in lost[:30]) + (f"  and {len(lost) - 30} more\n" if len(lost) > 30 else ""), end="")
            print("restore it, or raise the version (docs/concepts/stability.md says where it stands) and run 'interfaces.py write'; "
                  "what was in no release may go with 'write --unreleased'")
        elif what == "write":
            file.write_text("\n".join([f"version {version}", *sorted(new)]) + "\n")
        elif what == "exact" and (before, old) != (version, new):
            is_right = False
            print(f"{name}: {len(new - old)} facts of version {version} are new; write them: tests/stability/interfaces.py write BUILD")
    return is_right


def has_clang():
    """Debian's bindings; whoever runs this may have another Python."""
    folder = pathlib.Path("/usr/lib/python3/dist-packages")
    sys.path += [str(HERE), str(folder)]
    if not (folder / "clang/cindex.py").exists():
        print("this needs python3-clang-14, which 'scripts/deps test' installs")
        return False
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["check", "exact", "write"])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--unreleased", action="store_true")
    parser.add_argument("--only", action="append", choices=NAMES)
    options = parser.parse_args()
    if not has_clang():
        sys.exit(77)
    interfaces = Interfaces(ROOT, options.build.resolve())
    sys.exit(not run(interfaces, options.what, HERE / "facts", options.only or NAMES, options.unreleased))


if __name__ == "__main__":
    main()
