"""Recordings, of files and of runs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _native

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas
    import xarray
    from numpy.typing import NDArray


class Series:
    """A recorded signal: `values[k]` was taken at `time[k]`."""

    def __init__(self, recording: Recording, number: int, path: str) -> None:
        self._recording = recording
        self._number = number
        self._info = recording._native._info(number)
        self.path = path  #: 'controller.tau'

    @property
    def nanoseconds(self) -> NDArray[Any]:
        """Times as the recording has them [ns], (samples,)."""
        return self._recording._native._nanoseconds(self._number)

    @property
    def time(self) -> NDArray[Any]:
        """[s], (samples,)"""
        return self.nanoseconds / 1e9

    @property
    def values(self) -> NDArray[Any]:
        """(samples,) of a scalar, (samples, n), or (samples, rows, columns); not to be written."""
        return self._recording._native._values(self._number)

    @property
    def unit(self) -> str:
        """'N.m', 'rad'; empty for none."""
        return str(self._info["unit"])

    @property
    def doc(self) -> str:
        """What the signal is."""
        return str(self._info["doc"])

    @property
    def period(self) -> float:
        """Between two samples [s]; 0: they are not periodic."""
        return float(self._info["period"])

    @property
    def is_held(self) -> bool:
        """Does it keep its value until the next sample?"""
        return bool(self._info["is_held"])

    @property
    def element_names(self) -> list[str]:
        """Of a vector, such as joints; empty where its elements have no names."""
        return list(self._info["element_names"])

    @property
    def value_names(self) -> dict[float, str]:
        """Names of values, as of an enumeration."""
        return dict(self._info["value_names"])

    def elements(self) -> list[str]:
        """What stands behind the path for each element, row by row: '[l_knee]', '[4]', '[1][3]', counted from 1."""
        shape = self.values.shape[1:]
        if not shape:
            return [""]
        if len(shape) == 1:
            names = self.element_names or [""] * shape[0]
            return [f"[{name or i + 1}]" for i, name in enumerate(names)]
        return [f"[{r + 1}][{c + 1}]" for r in range(shape[0]) for c in range(shape[1])]

    def __len__(self) -> int:
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        import numpy

        return numpy.array(self.values, dtype=dtype, copy=copy)

    def to_xarray(self, time: str = "time") -> xarray.DataArray:
        """With the time as coordinate, the names of elements, and the unit."""
        import xarray

        values = self.values
        dims = [time, *(f"{self.path}_{axis}" for axis in range(1, values.ndim))]
        coords: dict[str, Any] = {time: (time, self.time[: len(values)], {"units": "s"})}
        if values.ndim == 2 and self.element_names:
            coords[dims[1]] = self.element_names
        attrs = {key: text for key, text in (("units", self.unit), ("long_name", self.doc)) if text}
        return xarray.DataArray(values, dims=dims, coords=coords, name=self.path, attrs=attrs)

    def __repr__(self) -> str:
        values = self.values
        unit = f" [{self.unit}]" if self.unit else ""
        return f"<Series {self.path}{unit}: {len(values)} samples of {values.dtype}{values.shape[1:]}>"


class Recording(Mapping[str, Series]):
    """What was recorded, by the paths of signals: `recording['controller.tau'].values`."""

    def __init__(self) -> None:
        self._native = _native.Recording()

    @property
    def complete(self) -> bool:
        """False of a file that was cut or damaged: then the rest is what could be read, and `defect` says what is wrong."""
        return self._native.complete

    @property
    def defect(self) -> str:
        """What was found wrong with the file; empty: nothing."""
        return self._native.defect

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """Sets of texts by their names: model, overrides, plots."""
        return self._native.metadata

    @property
    def attachments(self) -> dict[str, bytes]:
        """Files in the recording by their names: the model's texts, snapshots."""
        return self._native.attachments

    def __getitem__(self, path: str) -> Series:
        return Series(self, self._native._number(path), path)

    def __iter__(self) -> Iterator[str]:
        return iter(self._native._names())

    def __len__(self) -> int:
        return len(self._native._names())

    def __contains__(self, path: object) -> bool:
        return path in self._native._names()

    @property
    def plots(self) -> dict[str, list[str]]:
        """Signals that the model draws, by the titles of panels."""
        panels = self.metadata.get("plots", {})
        return {key.partition(" ")[2]: panels[key].split("\n") for key in sorted(panels)}

    def _by_times(self) -> list[tuple[str, list[Series]]]:
        """Signals of equal times together, and what their dimension is called: 'time' of the most samples."""
        groups: dict[bytes, list[Series]] = {}
        for series in self.values():
            groups.setdefault(series.nanoseconds.tobytes(), []).append(series)
        ordered = sorted(groups.values(), key=lambda group: -len(group[0]))
        return [("time" if i == 0 else f"time_{i + 1}", group) for i, group in enumerate(ordered)]

    def to_numpy(self) -> dict[str, NDArray[Any]]:
        """Values by path."""
        return {path: self[path].values for path in self}

    def to_xarray(self) -> xarray.Dataset:
        """A variable for each signal. Those of one rate share a coordinate: 'time' has the most samples, the others are
        'time_2', ..."""
        import xarray

        return xarray.Dataset(
            {series.path: series.to_xarray(time) for time, group in self._by_times() for series in group}
        )

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each element, 'controller.tau[l_knee]', over the times of all [s]; NaN where a slower signal has no
        sample."""
        import pandas

        frames = []
        for _, group in self._by_times():
            columns = {}
            for series in group:
                values = series.values
                flat = values.reshape(len(values), len(series.elements()))
                for i, element in enumerate(series.elements()):
                    columns[series.path + element] = flat[:, i]
            # An event has the time of the step that it happens in: samples of one time keep their order.
            time = pandas.Series(group[0].time, name="time")
            index = pandas.MultiIndex.from_arrays([time, time.groupby(time).cumcount()])
            frames.append(pandas.DataFrame(columns, index=index))
        table = pandas.concat(frames, axis=1).sort_index() if frames else pandas.DataFrame()
        if frames:
            table.index = table.index.get_level_values("time")
        order = [series.path + element for series in self.values() for element in series.elements()]
        return table[order]

    def plot(self, signals: Sequence[str] | Mapping[str, Sequence[str]] | None = None) -> matplotlib.figure.Figure:
        """Draws panels, by their titles, or one for each signal; else those that the model asks for, else all signals.
        Needs matplotlib."""
        from ._plot import plot

        return plot(self, signals)

    def _repr_svg_(self) -> str | None:
        from ._plot import svg

        return svg(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    def __repr__(self) -> str:
        return f"<Recording of {len(self)} signals: {', '.join(list(self)[:8])}{', ...' if len(self) > 8 else ''}>"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)


def read_recording(file: str | os.PathLike[str]) -> Recording:
    """An MCAP file of `bf run`, of `record_to`, or of another program. Throws FileError."""
    recording = Recording()
    _native._load_recording(Path(file), recording._native)
    return recording
