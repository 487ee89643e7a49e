"""Running a model for many values."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from . import errors
from ._expression import changes, expression
from ._model import LoadedModel, Model

if TYPE_CHECKING:
    import pandas

Progress = Union[bool, "Callable[[int, int], object]"]


@dataclass(frozen=True)
class SweepRow:
    """What one run came to."""

    point: dict[str, Any]  #: the values that vary, by name
    results: dict[str, float]  #: the model's checks and outputs, and the last values that were asked for, by element
    error: str = ""  #: why it failed; empty when it did not
    failed_at: float = -1  #: [s]; below 0: before its first step


class SweepResult(Sequence[SweepRow]):
    """The rows of a sweep, in the order of its points."""

    def __init__(self, rows: Sequence[SweepRow]) -> None:
        self._rows = list(rows)

    def __getitem__(self, index: Any) -> Any:
        return self._rows[index]

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[SweepRow]:
        return iter(self._rows)

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each name that varies and each result, and 'error'."""
        import pandas

        return pandas.DataFrame([{**row.point, **row.results, "error": row.error} for row in self._rows])

    def _repr_html_(self) -> str | None:
        try:
            return str(self.to_pandas().to_html())
        except ImportError:
            return None

    def __repr__(self) -> str:
        failed = sum(bool(row.error) for row in self._rows)
        return f"<SweepResult of {len(self)} runs{f', {failed} failed' if failed else ''}>"


def _bar(progress: Progress, count: int) -> Callable[[int, int], object]:
    if callable(progress):
        return progress
    if not progress:
        return lambda done, count: None
    try:
        from tqdm.auto import tqdm
    except ImportError:

        def write(done: int, count: int) -> None:
            width = 30
            full = width * done // max(1, count)
            print(f"\r[{'#' * full}{' ' * (width - full)}] {done}/{count}", end="\n" if done == count else "", file=sys.stderr)

        return write
    bar = tqdm(total=count)

    def update(done: int, count: int) -> None:
        bar.update(done - bar.n)
        if done == count:
            bar.close()

    return update


def sweep(
    model: str | os.PathLike[str] | Model | LoadedModel,
    axes: Mapping[str, Sequence[Any]],
    *,
    overrides: Mapping[str, Any] | None = None,
    finals: Sequence[str] = (),
    jobs: int = 0,
    progress: Progress = False,
) -> SweepResult:
    """Runs the model to its stop time for every combination of values, the first name varying slowest, in processes of
    their own, so that a run that crashes is a row with an error:

        table = bf.sweep("m.yaml", {"Gain.Kp": [0.1, 0.2], "Gain.Ki": [1, 2]}, progress=True).to_pandas()

    Values and names are those of `load`. `finals`: signals whose last values are results, too. `jobs`: processes, 0 one per
    processor. `progress`: True shows a bar (by tqdm, where it is installed), or a function of how many runs are done, and of
    how many. Throws ModelError, RunError; a model with blocks in Python is refused."""
    texts: dict[str, str] = {}
    given: list[tuple[str, str]] = []
    if isinstance(model, LoadedModel):
        if model._python_blocks:
            raise errors.RunError(
                f"{model.name} has blocks that are written in Python, which the processes of a sweep do not have; run it in "
                "threads: concurrent.futures.ThreadPoolExecutor().map"
            )
        texts, given = dict(model._native.files), list(model._native.overrides)
        file = os.fspath(model.file)
    elif isinstance(model, Model):
        file = os.path.abspath(model.file)
        texts = {file: model.text}
    else:
        file = os.path.abspath(model)
        if not Path(file).is_file():
            raise errors.FileError(f"there is no model file {file}")
    names = list(axes)
    for name, all in axes.items():
        if isinstance(all, str) or not isinstance(all, Iterable):
            raise errors.WrongValue(f"a sweep takes a list of values of '{name}', and not {all!r}")
    values = [list(axes[name]) for name in names]
    task = {
        "parent": os.getpid(),
        "file": file,
        "texts": texts,
        "axes": [[name, [expression(value) for value in all]] for name, all in zip(names, values)],
        "changes": given + changes(overrides, {}),
        "finals": [finals] if isinstance(finals, str) else list(finals),
        "jobs": jobs,
    }
    answer = _ask(task, progress)
    rows = []
    for i, row in enumerate(answer):
        point: dict[str, Any] = {}
        rest = i
        for name, all in zip(reversed(names), reversed(values)):
            point[name] = all[rest % len(all)]
            rest //= len(all)
        point = {name: point[name] for name in names}
        if row is not None:
            rows.append(SweepRow(point, dict(row[0]), row[1], row[2]))
    return SweepResult(rows)


def _ask(task: dict[str, Any], progress: Progress) -> list[Any]:
    # The worker finds the package where this one was found.
    path = os.pathsep.join([str(Path(__file__).absolute().parent.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    worker = subprocess.Popen(
        [sys.executable, "-m", "blockfactory._worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert worker.stdin and worker.stdout
    try:
        try:
            json.dump(task, worker.stdin)
            worker.stdin.close()
        except BrokenPipeError:
            pass  # its exit code says more
        show: Callable[[int, int], object] | None = None
        for line in worker.stdout:
            message = json.loads(line)
            if "done" in message:
                show = show or _bar(progress, message["count"])
                show(message["done"], message["count"])
            elif "error" in message:
                raise getattr(errors, message["error"], errors.RunError)(message["text"])
            else:
                rows: list[Any] = message["rows"]
                if show:
                    show(len(rows), len(rows))
                return rows
    finally:
        if worker.poll() is None:
            worker.terminate()
        worker.wait()
        worker.stdout.close()
    raise errors.RunError(f"the process of the sweep ended with {worker.returncode}")
