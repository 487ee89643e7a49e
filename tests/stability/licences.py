#!/usr/bin/env python3
"""licences.py PAGE: of what a package ships each licence is found, and a library that comes from nowhere is named."""

import pathlib
import shutil
import subprocess
import sys
import tempfile

root = pathlib.Path(__file__).resolve().parent.parent.parent
site = next((root / ".deps/venv/lib").glob("python3.*/site-packages"))


def licences(folder):
    return subprocess.run([sys.executable, root / "scripts/licences.py", "folder", folder], capture_output=True, text=True)


with tempfile.TemporaryDirectory() as folder:
    library = pathlib.Path(folder) / "lib"
    library.mkdir()
    shutil.copy(next((site / "mujoco").glob("libmujoco.so*")), library)
    shutil.copy(site / "cmeel.prefix/lib/libqpOASES.so.3.2", library)
    matio = pathlib.Path("/usr/lib/x86_64-linux-gnu/libmatio.so").resolve()
    shutil.copy(matio, library / matio.name.replace(".", "-0123abcd.", 1)) # as auditwheel calls it
    shutil.copy("/usr/bin/true", library / "libbf_core.so") # ours

    without = licences(folder)
    assert without.returncode != 0 and "the page has no licences.md" in without.stderr, without.stderr
    shutil.copytree(sys.argv[1], pathlib.Path(folder) / "share/blockfactory/page")
    whole = licences(folder)
    assert whole.returncode == 0, whole.stderr
    for owner, words in [("mujoco-core (PyPI)", "Apache License"), ("cmeel-qpoases (PyPI)", "GNU LESSER GENERAL PUBLIC LICENSE"),
                         ("libmatio11 (Debian)", "Redistribution"), ("ruckig-0.19.4", "Permission is hereby granted"),
                         ("packages in the editor's page (npm)", "## three")]:
        text = whole.stdout.split(f"\n{'=' * 100}\n{owner}\n")[1].split("=" * 100 + "\n")[1]
        assert words in text, f"{owner}:\n{text[:500]}"

    shutil.copy("/usr/bin/true", library / "libstrange.so.1")
    strange = licences(folder)
    assert strange.returncode != 0, strange.stdout
    assert "lib/libstrange.so.1: no wheel in .deps and no package of Debian has it" in strange.stderr, strange.stderr
    assert strange.stderr.count("\n  ") == 1, strange.stderr
