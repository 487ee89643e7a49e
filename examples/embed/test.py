"""Generates the model and runs it from C++, C and Python; all must come to the closed form.

Usage: test.py BF FOLDER_OF_EXAMPLE
"""
import pathlib
import subprocess
import sys
import tempfile

bf, source = sys.argv[1:]


def run(*command, **options):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    assert result.returncode == 0, f"{command}: {result.stdout}{result.stderr}"
    return result.stdout


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    report = run(bf, "generate", f"{source}/lowpass.yaml", "-o", folder / "model")
    assert "memory [bytes]: inputs 8, outputs 8," in report, report
    run("cmake", "-S", source, "-B", folder / "build", f"-DMODEL={folder / 'model'}", "-DCMAKE_BUILD_TYPE=Debug")
    run("cmake", "--build", folder / "build")
    results = [
        run(folder / "build/use_cpp"),
        run(folder / "build/use_c"),
        run(sys.executable, f"{source}/use_python.py", env={"PYTHONPATH": str(folder / "build/lowpass")}),
    ]
    assert len(set(results)) == 1, results
    assert abs(float(results[0]) - (1 - 0.8**10)) < 1e-15, results

    wrong = "from lowpass import Lowpass\nm = Lowpass()\nm.set_parameter('K.K', float('nan'))"
    result = subprocess.run([sys.executable, "-c", wrong], capture_output=True, text=True,
                            env={"PYTHONPATH": str(folder / "build/lowpass")})
    assert result.stderr.endswith("ValueError: K.K: parameter 'K.K' must be a number, but is NaN\n"), result.stderr

    # Without heap, exceptions and streams: the library needs nothing that would bring them.
    for options in ([], ["--single"], ["--language", "c++"], ["--language", "c++", "--single"]):
        options = ["--embedded", *options]
        bare = folder / "-".join(["bare", *options])
        run(bf, "generate", f"{source}/lowpass.yaml", "-o", bare, *options)
        run("cmake", "-S", bare, "-B", bare / "build", "-DCMAKE_BUILD_TYPE=Debug")
        run("cmake", "--build", bare / "build")
        needed = run("nm", "-uC", bare / "build/liblowpass_model.a")
        for word in ("operator new", "malloc", "__cxa", "std::", "_Unwind", "fopen", "printf"):
            assert word not in needed, needed
        header = (bare / ("lowpass.hpp" if "c++" in options else "lowpass.h")).read_text()
        assert ("float" in header) == ("--single" in options)
    result = subprocess.run([bf, "generate", f"{source}/lowpass.yaml", "-o", folder / "x", "--single"],
                            capture_output=True, text=True)
    assert result.returncode != 0 and "--embedded" in result.stderr, result.stderr
    assert not (folder / "x").exists()
