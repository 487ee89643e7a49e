"""The stub of the extension module: `python python/test/stubs.py` with the package in PYTHONPATH writes
python/blockfactory/_native.pyi anew, and a test compares."""

import importlib
import pathlib

import nanobind.stubgen

FILE = pathlib.Path(__file__).parents[1] / "blockfactory" / "_native.pyi"
IMPORTS = "from collections.abc import Callable\nfrom typing import Any\n\nfrom numpy.typing import NDArray\n\n"


def made() -> str:
    generator = nanobind.stubgen.StubGen(importlib.import_module("blockfactory._native"), include_private=True)
    generator.put(generator.module)
    # What nanobind leaves out, for mypy's strict mode.
    return IMPORTS + generator.get().replace("os.PathLike", "os.PathLike[str]")


if __name__ == "__main__":
    FILE.write_text(made())
