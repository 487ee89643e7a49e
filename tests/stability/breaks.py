#!/usr/bin/env python3
"""breaks.py BUILD: each interface that loses something, without a higher version, is found; so are changes of the sources."""

import contextlib
import io
import pathlib
import shutil
import sys
import tempfile

from interfaces import HERE, NAMES, ROOT, Interfaces, has_clang, is_raised, run

# file, what stands there, what is written in its place, which interfaces break
CHANGES = [
    ("analysis/include/bf/analysis/tune_loop.hpp", "const std::string& loop, double duration,", "const std::string& loop, float duration,", {"cpp"}),
    ("core/include/bf/core/registry.hpp", "    std::string group; ", "    int kind; std::string group; ", {"plugin"}),
    ("run/include/bf/run/run_c.h", "const char* name; /* of the model */", "int kind; const char* name;", {"run_c"}),
    ("formats/yaml/model.schema.json", '"required": ["model"]', '"required": ["model", "stop"]', {"model"}),
    ("python/blockfactory/_simulation.py", "def run(self, duration", "def run(self, seconds", {"python"}),
    ("middleware/udp/src/packet.hpp", "    welcome,\n    busy,", "    busy,\n    welcome,", {"udp"}),
    ("middleware/shared_memory/src/robot_file.hpp", "std::uint32_t text_bytes;", "std::uint64_t text_bytes;", {"shared_memory"}),
]


def said(interfaces, facts):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        is_right = run(interfaces, "check", facts)
    broken = {name for name in NAMES if f"{name}: what others rely on" in out.getvalue()}
    assert is_right == (not broken), out.getvalue()
    return broken, out.getvalue()


def main():
    if not has_clang():
        sys.exit(77)
    assert is_raised("0.1.0", "0.2.0") and is_raised("1.2.0", "2.0.0") and is_raised("5", "6")
    assert not is_raised("0.1.0", "0.1.1") and not is_raised("1.2.0", "1.3.0") and not is_raised("5", "5")

    build = pathlib.Path(sys.argv[1])
    interfaces = Interfaces(ROOT, build)
    with tempfile.TemporaryDirectory() as folder:
        facts = pathlib.Path(folder) / "facts"
        shutil.copytree(HERE / "facts", facts)
        for file in facts.glob("*.txt"):
            with file.open("a") as opened:
                opened.write("a fact that is gone\n")
        broken, text = said(interfaces, facts)
        assert broken == set(NAMES), text
        assert text.count("  - a fact that is gone\n") == len(NAMES), text
        for file in facts.glob("*.txt"): # what a lower version had may be gone
            file.write_text(f"version {'0.0.9' if '.' in file.read_text().splitlines()[0] else '0'}\na fact that is gone\n")
        assert said(interfaces, facts)[0] == set(), text

        source = pathlib.Path(folder) / "source"
        shutil.copytree(ROOT, source, ignore=lambda at, names: [
            name for name in names if not (pathlib.Path(at) / name).is_dir() and pathlib.Path(name).suffix not in (".hpp", ".h", ".json", ".py", ".pyi", ".txt")
            or name.startswith((".", "build", "node_modules", "facts"))])
        for file, before, after, _ in CHANGES:
            text = (source / file).read_text()
            assert before in text, f"{file} has no '{before}' any more; change something else there"
            (source / file).write_text(text.replace(before, after, 1))
        expected = set().union(*(names for *_, names in CHANGES))
        broken, text = said(Interfaces(source, build), HERE / "facts")
        assert broken == expected, f"{broken} in place of {expected}:\n{text}"


if __name__ == "__main__":
    main()
