"""Recordings as pictures, by matplotlib where it is installed."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import matplotlib.figure

    from ._recording import Recording, Series

_MOST_PANELS = 12


def _panels(recording: Recording, signals: Sequence[str] | Mapping[str, Sequence[str]] | None) -> dict[str, list[Series]]:
    if isinstance(signals, Mapping):
        return {title: [recording[path] for path in paths] for title, paths in signals.items()}
    if signals is not None:
        return {path: [recording[path]] for path in ([signals] if isinstance(signals, str) else signals)}
    asked: dict[str, list[Series]] = {}
    for title, paths in recording.plots.items():
        there = [recording[path] for path in paths if _has(recording, path)]
        if there:
            asked[title] = there
    return asked or {path: [recording[path]] for path in list(recording)[:_MOST_PANELS]}


def _has(recording: Recording, path: str) -> bool:
    try:
        recording._native._number(path)
    except KeyError:
        return False
    return True


def plot(recording: Recording, signals: Sequence[str] | Mapping[str, Sequence[str]] | None = None) -> matplotlib.figure.Figure:
    """Panels above one time axis."""
    from matplotlib.figure import Figure

    panels = _panels(recording, signals)
    figure = Figure(figsize=(9, 0.6 + 2.1 * max(1, len(panels))), layout="constrained")
    axes = figure.subplots(max(1, len(panels)), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (title, all_series) in zip(axes, panels.items()):
        units = {series.unit for series in all_series}
        unit = units.pop() if len(units) == 1 else ""
        curves = 0
        for series in all_series:
            values = series.values
            flat = values.reshape(len(values), len(series.elements()))
            time = series.time[: len(values)]
            for i, element in enumerate(series.elements()):
                axis.plot(
                    time,
                    flat[:, i],
                    label=series.path + element,
                    linewidth=1.2,
                    linestyle="--" if series.path.endswith("reference") else "-",
                    drawstyle="steps-post" if flat.dtype.kind in "biu" else "default",
                )
                curves += 1
            if series.value_names and len(all_series) == 1:
                axis.set_yticks(list(series.value_names), list(series.value_names.values()))
        axis.set_title(title, fontsize=10, loc="left")
        axis.set_ylabel(unit)
        axis.grid(alpha=0.3, linewidth=0.6)
        if 1 < curves <= 12:
            axis.legend(fontsize=8, loc="best")
    axes[-1].set_xlabel("time [s]")
    return figure


def svg(recording: Recording) -> str | None:
    """None where there is no matplotlib."""
    try:
        figure = plot(recording)
    except ImportError:
        return None
    text = io.StringIO()
    figure.savefig(text, format="svg")
    return text.getvalue()
