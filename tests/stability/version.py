#!/usr/bin/env python3
"""version.py BF: the version stands in CMakeLists.txt alone; the newest entry of CHANGELOG.md is of it, and the program says it."""

import pathlib
import re
import subprocess
import sys

root = pathlib.Path(__file__).resolve().parent.parent.parent
version = re.search(r"project\(BlockFactory VERSION ([\d.]+)", (root / "CMakeLists.txt").read_text())[1]
newest = re.search(r"^## (\S+)", (root / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
assert newest == version, f"the newest entry of CHANGELOG.md is of {newest}, the version is {version}"
said = subprocess.run([sys.argv[1], "--version"], check=True, stdout=subprocess.PIPE, text=True).stdout
assert said == f"bf {version}\n", said
assert (root / f"tests/stability/recordings/{version}.mcap").exists(), f"tests/stability/recordings has none of {version}"
for file in ["pyproject.toml", "python/blockfactory/__init__.py", "editor/page/package.json", "tools/test/verbs_test.cpp"]:
    assert f'"{version}"' not in (root / file).read_text(), f"{file} says the version a second time"
