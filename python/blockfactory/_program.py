"""The program `bf` of the wheel."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ._packages import find_robots


def main() -> None:
    """Becomes the program."""
    find_robots()
    program = Path(__file__).parent / "bin" / "bf"
    if not program.exists():
        sys.exit(f"there is no {program}: this is a package in a build folder, whose program is in the build's bin/")
    os.execv(program, [os.fspath(program), *sys.argv[1:]])
