"""Breaks the rules of the structure on purpose, one at a time, and expects each to be named."""
import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(sys.argv[1]) / "scripts" / "check_structure.py"
TABLE = """## Folders and arrows

| folder | what | may include |
| --- | --- | --- |
| `low/` | base | Eigen |
| `high/` | top | `low` |
"""
CASES = {
    "low/src/a.cpp": ('#include "bf/high/x.hpp"\n', "low/src/a.cpp:1: low/ may not include bf/high/x.hpp"),
    "high/src/b.cpp": ("// b\n#include <mujoco/mujoco.h>\n", "high/src/b.cpp:2: high/ may not include mujoco/mujoco.h (MuJoCo)"),
    "low/include/bf/low/c.hpp": ("//\n" * 401, "low/include/bf/low/c.hpp: 401 lines, the limit is 400"),
    "low/src/d.cpp": ("//\n" * 701, "low/src/d.cpp: 701 lines, the limit is 700"),
    "low/README.md": ("# low\n\nMay include: Eigen.\n", "low/README.md:3: who may include whom is said in ARCHITECTURE.md alone"),
    "high/README.md": ("# high\n\nHeld by `High.IsHigh` and `High.IsThere`.\n", "high/README.md:3: there is no test High.IsHigh"),
    "odd/src/e.cpp": ("", "odd/src/e.cpp: the folder has no row in ARCHITECTURE.md"),
}


def check(files):
    with tempfile.TemporaryDirectory() as root:
        for name, text in files.items():
            path = pathlib.Path(root) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return subprocess.run([sys.executable, CHECK, root], capture_output=True, text=True)


legal = {"ARCHITECTURE.md": TABLE, "high/src/ok.cpp": '#include "bf/low/x.hpp"\n#include <vector>\n',
         "low/test/t.cpp": '#include "bf/high/x.hpp"\nTEST_F(High, IsThere) {}\n'}
result = check(legal)
assert result.returncode == 0 and not result.stdout, result.stdout
for file, (text, expected) in CASES.items():
    result = check({**legal, file: text})
    assert result.returncode == 1 and expected in result.stdout, f"{file}: expected '{expected}', got: {result.stdout}"
result = check({**legal, "ARCHITECTURE.md": "## Folders and arrows\n"})
assert result.returncode == 1 and "the table of folders was not found" in result.stdout, result.stdout
