"""Frequency responses that were measured in simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._analysis import _figure
from .errors import WrongValue

if TYPE_CHECKING:
    import matplotlib.figure
    from numpy.typing import NDArray

    from . import _native
    from ._simulation import Simulation


class FrequencyResponse:
    """What comes of sines, or of a chirp, that were added to a signal of a run: arrays with an element per frequency."""

    def __init__(self, native: _native._MeasuredResponse, loop: str) -> None:
        import numpy

        self._loop = loop
        self.input: str = native.input
        self.output: str = native.output
        self.amplitude: float = native.amplitude
        self.time: float = native.time
        self.omega: NDArray[Any] = numpy.array(native.omega)
        self.value: NDArray[Any] = numpy.array(native.value, dtype=complex)
        self.magnitude: NDArray[Any] = numpy.array(native.magnitude)
        self.phase: NDArray[Any] = numpy.array(native.phase)
        self.coherence: NDArray[Any] = numpy.array(native.coherence)
        self.distortion: NDArray[Any] = numpy.array(native.distortion)
        self.unsettled: NDArray[Any] = numpy.array(native.unsettled)

    def to_control(self) -> Any:
        """control.FrequencyResponseData of python-control."""
        import control

        return control.frd(self.value, self.omega)

    def bode(self) -> matplotlib.figure.Figure:
        """Magnitude [dB], phase [degrees], and distortion [%], of a chirp the coherence, over frequency [rad/s]."""
        import numpy

        is_chirp = bool(numpy.isnan(self.distortion).any())
        figure, axes = _figure(3)
        last = (self.coherence, "coherence") if is_chirp else (100 * self.distortion, "distortion [%]")
        for axis, (values, name) in zip(
            axes, ((self.magnitude, "magnitude [dB]"), (self.phase, "phase [degrees]"), last)
        ):
            axis.semilogx(self.omega, values, "o-", linewidth=0.8, markersize=4)
            axis.set_ylabel(name)
        title = f"loop through {self._loop}" if self._loop else f"from {self.input} to {self.output}"
        axes[0].set_title(f"{title}, amplitude {self.amplitude:g}", fontsize=10, loc="left")
        axes[-1].set_xlabel("frequency [rad/s]")
        return figure

    def __repr__(self) -> str:
        return f"<FrequencyResponse: {len(self.omega)} frequencies, from {self.input} to {self.output}>"


def measured(
    sim: Simulation,
    from_: str,
    to: str,
    omega: Any,
    loop: str,
    amplitude: float,
    chirp: bool,
    tolerance: float,
    most_periods: int,
) -> FrequencyResponse:
    import numpy

    from . import _native

    if bool(loop) == bool(from_ or to) or (not loop and not (from_ and to)):
        raise WrongValue("a response is from one signal to another: give from_ and to, or loop")
    frequencies = numpy.atleast_1d(omega).astype(float).tolist()
    return FrequencyResponse(
        _native._measure_response(sim, from_, to, loop, frequencies, amplitude, chirp, tolerance, most_periods), loop
    )
