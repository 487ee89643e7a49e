"""The page for users does what it says."""

import contextlib
import io
import os
import re

from conftest import ROOT


def matches(expected, printed):
    return re.fullmatch(".*?".join(map(re.escape, expected.strip().split("…"))), printed.strip(), re.S)


def test_the_page_does_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    page = (ROOT / "docs/how-to/use_from_python.md").read_text()
    names, count = {}, 0
    for code, expected in re.findall(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```$", page, re.M | re.S):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "use_from_python.md", "exec"), names)
        assert matches(expected, printed.getvalue()), printed.getvalue()
        count += 1
    assert count == page.count("```python\n")
