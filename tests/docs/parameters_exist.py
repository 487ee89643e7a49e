#!/usr/bin/env python3
"""The blocks and arguments that a page's table of parameters names are in the reference: parameters_exist.py ROOT."""

import pathlib
import re
import sys

docs = pathlib.Path(sys.argv[1]) / "docs"
reference = (docs / "reference" / "whole_body_toolbox.md").read_text()
known = {}
for section in re.split(r"^### ", reference, flags=re.MULTILINE)[1:]:
    known[section.split("\n", 1)[0]] = set(re.findall(r"^\| `(\w+)`", section, flags=re.MULTILINE))

page = (docs / "concepts" / "paper_toolbox.md").read_text().split("## Parameters")[1]
rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", page, flags=re.MULTILINE)
wrong = [f"there is no block {block}" for block, _ in rows if block not in known]
for block, text in rows:
    wrong += [f"{block} has no {name}" for name in re.findall(r"`(\w+)`", text) if name not in known.get(block, ())]
if len(rows) < 15:
    wrong.append(f"only {len(rows)} rows were found")
sys.exit("\n".join(wrong) or None)
