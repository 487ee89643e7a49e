"""misspelled_input.py BF: does the Python module of a generated model refuse an input that the model does not have?"""
import ctypes
import pathlib
import subprocess
import sys
import tempfile
import unittest.mock

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "m.yaml").write_text(
        "model: m\nstep: 0.1\ninputs: {omega: {}}\noutputs: {y: {}}\n"
        "blocks: {g: {block: Gain}}\nconnections: {omega: g, g: y}\n"
    )
    subprocess.run([sys.argv[1], "generate", folder / "m.yaml", "-o", folder / "out"], check=True)
    sys.path.insert(0, str(folder / "out"))
    with unittest.mock.patch.object(ctypes, "CDLL"):  # its structures need no library
        from m import Inputs, Outputs
    inputs = Inputs()
    inputs.omega = 1
    assert inputs.omega == 1
    for structure in inputs, Outputs():
        try:
            structure.omga = 1
        except AttributeError as wrong:
            assert "omga" in str(wrong), wrong
        else:
            raise AssertionError(f"{structure} has a new member")
