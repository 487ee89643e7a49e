"""Where robots are."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from .errors import FileError


def find_robots() -> None:
    """Has the library look into this environment's share/, where the wheel icub-models puts the iCub."""
    share = os.fspath(Path(sys.prefix) / "share")
    known = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    if share not in known and (Path(share) / "iCub").is_dir():
        os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(filter(None, [*known, share]))


def prefix() -> Path:
    """Where the wheel has its installation, for CMAKE_PREFIX_PATH: bin/, include/, lib/cmake/."""
    folder = Path(__file__).parent
    if not (folder / "lib" / "cmake").is_dir():
        raise FileError("this package stands in a build folder; install the build, and use that")
    return folder


def example(name: str) -> Path:
    """A model that comes with the package: bf.example('icub_balancing/balancing.yaml')."""
    folder = Path(__file__).parent / "examples"
    if not (folder / name).is_file():
        known = sorted(str(file.relative_to(folder)) for file in folder.glob("*/*.yaml"))
        raise FileError(f"there is no example '{name}'; there is {', '.join(known)}")
    return folder / name
