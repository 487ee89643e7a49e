"""Every rule of a page names the tests that hold it: rules_have_tests.py SOURCES PAGE...

A rule is a paragraph, an item of a list or a row of a table; code, headings and what ends with a colon are none. Its tests
stand in a comment behind it, <!-- Suite.Name Suite.Name -->, and must exist in a source file."""

import pathlib
import re
import sys

sources = pathlib.Path(sys.argv[1])
known = set()
for file in [*sources.glob("*/**/test/**/*.cpp"), *sources.glob("tests/**/*.cpp")]:
    if "build" not in file.relative_to(sources).parts[:1]:
        known |= {".".join(pair) for pair in re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", file.read_text(), re.M)}

problems = []
for page in sys.argv[2:]:
    text = re.sub(r"^```.*?^```$", lambda code: "\n" * code[0].count("\n"), (sources / page).read_text(), flags=re.M | re.S)
    lines, rules = text.splitlines(), []  # (line, text)
    header = None  # of a table
    for number, line in enumerate(lines, 1):
        begins = re.match(r"\d+\. |- |\|", line) or not line.strip() or line.startswith("#")
        if line.startswith("#") or not line.strip():
            rules.append((number, ""))
        elif begins or not rules:
            rules.append((number, line))
        else:
            rules[-1] = (rules[-1][0] if rules[-1][1] else number, rules[-1][1] + "\n" + line)
    for index, (number, rule) in enumerate(rules):
        tests = [name for comment in re.findall(r"<!--(.*?)-->", rule, re.S) for name in comment.split()]
        said = re.sub(r"<!--.*?-->", "", rule, flags=re.S).strip()
        is_head = said.startswith("| ---") or (index + 1 < len(rules) and rules[index + 1][1].startswith("| ---"))
        if said and not is_head and not said.endswith(":") and not tests:
            problems.append(f"{page}:{number}: no test is named for: {said.splitlines()[0]}")
        problems += [f"{page}:{number}: there is no test {name}" for name in tests if name not in known]
print("\n".join(problems) or "every rule has its tests")
sys.exit(bool(problems))
