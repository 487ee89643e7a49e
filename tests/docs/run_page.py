#!/usr/bin/env python3
"""run_page.py PAGE BUILD: does a page of the documentation do what it says?

Fences of the page, in a temporary folder that looks like the repository with its build:
    ```sh               run in order by one bash; must succeed
    ```sh fails         must fail
    ```sh not run       for readers only; the first line says `# No test runs this: ` and why
    ```text output      what the commands above it print; … stands for anything
    ```LANGUAGE FILE    written to FILE before anything runs
    ```LANGUAGE FILE = PATH    so, and must equal PATH of the repository
    ```yaml             with `model:` first: a model, which must run
Relative links of the page must lead somewhere.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MARK = "----- end of block"


def fences(text):
    """(line, information, content) of every fence."""
    for match in re.finditer(r"^```([^\n]+)\n(.*?)^```$", text, re.M | re.S):
        yield text.count("\n", 0, match.start()) + 1, match.group(1).split(), match.group(2)


def matches(expected, printed):
    pattern = "".join(".*?" if part == "…" else re.escape(part) for part in re.split("(…)", expected.strip()))
    return re.fullmatch(pattern, printed.strip(), re.S) is not None


def main(page, build):
    text = page.read_text()
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    problems = [f"link {link} leads nowhere" for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", prose)
                if "://" not in link and not (page.parent / link).exists()]
    with tempfile.TemporaryDirectory(prefix="bf_docs_") as name:
        folder = pathlib.Path(name)
        for entry in ROOT.iterdir():
            if not entry.name.startswith((".", "build")):
                (folder / entry.name).symlink_to(entry)
        (folder / "build").symlink_to(build)

        script, blocks = [], []  # blocks: (line, expected output or None)
        for line, info, content in fences(text):
            if info[0] == "sh" and info[1:] != ["not", "run"]:
                fails = info[1:] == ["fails"]
                script.append(f"if ( set -e\n{content}) 2>&1; then echo 'this should fail'; exit 1; fi" if fails else content)
                script.append(f"echo '{MARK}'")
                blocks.append((line, None))
            elif info == ["sh", "not", "run"] and not content.startswith("# No test runs this: "):
                problems.append(f"line {line}: commands that no test runs begin with `# No test runs this: ` and why")
            elif info == ["text", "output"]:
                blocks[-1] = (line, content)
            elif info == ["yaml"] and content.startswith("model:"):
                (folder / f"line_{line}.yaml").write_text(content)
                script += [f"bf run --quiet line_{line}.yaml", f"echo '{MARK}'"]
                blocks.append((line, None))
            elif len(info) > 1 and info[0] not in ("sh", "text"):
                (folder / info[1]).parent.mkdir(parents=True, exist_ok=True)
                (folder / info[1]).write_text(content)
                if info[2:3] == ["="] and content != (ROOT / info[3]).read_text():
                    problems.append(f"line {line}: {info[1]} is not {info[3]}")
        environment = {k: v for k, v in os.environ.items() if not k.startswith("BLOCKFACTORY")}
        environment |= {"HOME": name, "PATH": f"{build}/bin:{os.environ['PATH']}"}
        run = subprocess.run(["bash", "-euo", "pipefail", "-c", "exec 2>&1\n" + "\n".join(script)], cwd=folder,
                             env=environment, stdout=subprocess.PIPE, text=True)
    printed = run.stdout.split(MARK + "\n")
    if run.returncode:
        line = blocks[min(len(printed), len(blocks)) - 1][0]
        problems.append(f"what stands at line {line} fails:\n{printed[-1]}")
    for (line, expected), output in zip(blocks, printed):
        if expected is not None and not matches(expected, output):
            problems.append(f"line {line}: the commands print\n{output}")
    return problems


found = main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())
for problem in found:
    print(f"{sys.argv[1]}: {problem}")
sys.exit(bool(found))
