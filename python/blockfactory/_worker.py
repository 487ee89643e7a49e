"""Carries out a sweep for blockfactory.sweep: workers are forked, which only a process of one thread may do, so it runs in
one of its own that loads nothing but the module. Reads the task as JSON from its standard input, writes lines of JSON."""

from __future__ import annotations

import json
import os
import sys
from typing import Any


def main() -> None:
    # The package itself would load more than a forking process should have.
    from blockfactory import _native

    task = json.load(sys.stdin)
    out = os.fdopen(os.dup(1), "w", buffering=1)

    def write(message: dict[str, Any]) -> None:
        out.write(json.dumps(message) + "\n")

    last = -1

    def progress(done: int, count: int) -> bool:
        nonlocal last
        if done != last:
            last = done
            write({"done": done, "count": count})
        return bool(os.getppid() == task["parent"])

    try:
        rows = _native._sweep(
            task["file"],
            task["texts"],
            [(name, values) for name, values in task["axes"]],
            [(name, value) for name, value in task["changes"]],
            task["finals"],
            task["jobs"],
            progress,
        )
    except Exception as error:  # it is raised where the task came from
        write({"error": type(error).__name__, "text": str(error)})
        return
    write({"rows": rows})


if __name__ == "__main__":
    main()
