#!/usr/bin/env python3
"""Checks the sources against the table "Folders and arrows" of ARCHITECTURE.md and the size limits of STYLE.md. The
table stands once: a folder's README does not repeat its row. Tests that it names as `Suite.Test` are there.

Usage: check_structure.py [ROOT]. A folder may include its own headers, those of the folders that its row names, and
the outside libraries that its row names. Exits 1 and lists every violation with its file and line.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent).resolve()
EVERYTHING = "everything"
# Which words of the table stand for which headers.
LIBRARIES = {
    "Eigen": ("Eigen/", "unsupported/Eigen"),
    "Pinocchio": ("pinocchio/", "urdf_parser/", "console_bridge/", "urdf_model/", "urdf_world/"),
    "tinyxml2": ("tinyxml2.h",),
    "minizip": ("unzip.h", "zip.h"),
    "MuJoCo": ("mujoco/",),
    "Assimp": ("assimp/",),
    "OSMesa": ("GL/",),
    "matio": ("matio.h",),
    "libdeflate": ("libdeflate.h",),
    "zlib": ("zlib.h",),
    "SUNDIALS": ("cvode/", "kinsol/", "nvector/", "sunlinsol/", "sunmatrix/", "sundials/"),
    "yaml-cpp": ("yaml-cpp/",),
    "DAQP": ("api.h", "types.h", "utils.h", "constants.h"),
    "ProxQP": ("proxsuite/",),
    "qpOASES": ("qpOASES.hpp", "qpOASES/"),
    "OSQP": ("osqp.h", "auxil.h", "scaling.h", "qdldl_interface.h"),
    "Ruckig": ("ruckig/",),
    "CLI11": ("CLI/",),
    "nanobind": ("nanobind/", "Python.h"),
    "nlohmann-json": ("nlohmann/",),
    "Boost": ("boost/",),
    "YARP": ("yarp/",),
    "ROS 1": ("ros/", "xmlrpcpp/"),
    "ROS 2": ("rcl/", "rcutils/", "rosidl_", "builtin_interfaces/", "geometry_msgs/", "rosgraph_msgs/", "sensor_msgs/", "std_msgs/", "std_srvs/", "trajectory_msgs/"),
    "iDynTree": ("iDynTree/",),
    "GoogleTest": ("gtest/", "gmock/"),
    "Google Benchmark": ("benchmark/",),
}
PUBLIC_HEADER_LINES, SOURCE_LINES = 400, 700


def read_table():
    """Folder -> set of what it may include, from the rows `| `folder/` | what | may include |`."""
    text = (ROOT / "ARCHITECTURE.md").read_text()
    section = text.split("## Folders and arrows", 1)[1].split("\n## ", 1)[0]
    table = {}
    for row in re.findall(r"^\| `([\w/]+)/` \|[^|]*\|([^|]*)\|$", section, re.M):
        folder, allowed = row
        table[folder] = {word.strip(" `") for word in allowed.split(",")}
    return table


def folder_of(header, folders):
    """The folder that a header bf/<name>/... belongs to."""
    match = re.match(r"bf/(\w+)(/(\w+))?", header)
    if not match:
        return None
    for name in (match.group(1), f"toolbox/{match.group(1)}", f"middleware/{match.group(1)}", f"editor/{match.group(1)}", f"formats/{match.group(3)}"):
        if name in folders:
            return name
    return "formats/yaml" if match.group(1) == "formats" else match.group(1)


def main():
    table = read_table()
    problems = []
    tests = set()
    for path in sorted(ROOT.rglob("*")):
        relative = path.relative_to(ROOT)
        top = relative.parts[0] if relative.parts else ""
        if top.startswith((".", "build")) or path.suffix not in (".hpp", ".cpp", ".h", ".c") or not path.is_file():
            continue
        name = str(relative)
        lines = path.read_text(errors="replace").splitlines()
        is_public = "/include/" in name
        limit = PUBLIC_HEADER_LINES if is_public else SOURCE_LINES
        if len(lines) > limit:
            problems.append(f"{name}: {len(lines)} lines, the limit is {limit}: split it by what it does")
        folder = next((f for f in sorted(table, key=len, reverse=True) if name.startswith(f + "/")), None)
        if folder is None:
            if top not in ("cmake", "scripts"):
                problems.append(f"{name}: the folder has no row in ARCHITECTURE.md")
            continue
        allowed = table[folder]
        is_test = "/test/" in name
        if is_test:
            tests.update(re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", "\n".join(lines), re.MULTILINE))
        if EVERYTHING in allowed or is_test:
            continue
        for number, line in enumerate(lines, 1):
            match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
            if not match:
                continue
            header = match.group(1)
            if header.startswith("bf/"):
                target = folder_of(header, table)
                if target != folder and target not in allowed:
                    problems.append(f"{name}:{number}: {folder}/ may not include {header}")
                continue
            for library, prefixes in LIBRARIES.items():
                if header.startswith(prefixes) and library not in allowed and not (path.parent / header).exists():
                    problems.append(f"{name}:{number}: {folder}/ may not include {header} ({library})")
    for path in sorted(ROOT.glob("*/**/README.md")):
        relative = path.relative_to(ROOT)
        if relative.parts[0].startswith((".", "build")):
            continue
        for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
            if "may include" in line.lower():
                problems.append(f"{relative}:{number}: who may include whom is said in ARCHITECTURE.md alone")
            for suite, test in re.findall(r"`([A-Z]\w+)\.([A-Z]\w+)`", line):
                if (suite, test) not in tests:
                    problems.append(f"{relative}:{number}: there is no test {suite}.{test}")
    if not table:
        problems.append("ARCHITECTURE.md: the table of folders was not found")
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
