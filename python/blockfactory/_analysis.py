"""Linear systems of models: matrices by name, responses, margins, and their pictures by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import _native
from .errors import UnknownName, WrongValue

if TYPE_CHECKING:
    import matplotlib.figure
    from numpy.typing import NDArray

    from ._native import Margins, StepResponse

_FARTHEST = 8.0  # that a Nyquist curve is drawn: integrators lead to infinity


def options(
    from_: str | Sequence[str], to: str | Sequence[str], open: str | Sequence[str], loop: str, all_states: bool
) -> _native._LinearizeOptions:
    """One name stands for a list of it."""
    if loop and (from_ or to):
        raise WrongValue("a loop is named by one signal: give loop, or from_ and to")
    from ._simulation import _listed

    names = [_listed(one) or [] for one in (loop or from_, loop or to, open)]
    return _native._LinearizeOptions(names[0], names[1], names[2] + [loop] * bool(loop), all_states, False)


class LinearSystem:
    """x' = A x + B u, y = C x + D u, or from sample to sample where `period` is not 0 (`dt` of python-control): deviations
    from the operating point x, u, y at `time`. Inputs and outputs are chosen by name or number."""

    def __init__(self, native: _native.LinearSystem) -> None:
        self._native = native
        self.A: NDArray[Any] = native.A
        self.B: NDArray[Any] = native.B
        self.C: NDArray[Any] = native.C
        self.D: NDArray[Any] = native.D
        self.x: NDArray[Any] = native.x
        self.u: NDArray[Any] = native.u
        self.y: NDArray[Any] = native.y

    @property
    def states(self) -> list[str]:
        """Names, as those of the next ones: 'plant.x[2]'."""
        return self._native.states

    @property
    def inputs(self) -> list[str]:
        """As `from_` named them."""
        return self._native.inputs

    @property
    def outputs(self) -> list[str]:
        """As `to` named them."""
        return self._native.outputs

    @property
    def period(self) -> float:
        """[s]; 0 in continuous time."""
        return self._native.period

    @property
    def time(self) -> float:
        """Of the operating point [s]."""
        return self._native.time

    @property
    def differenced(self) -> list[str]:
        """Blocks of which no exact derivative is known: their part was found by central differences."""
        return self._native.differenced

    @property
    def held(self) -> list[str]:
        """What was held although it may move, with the reason."""
        return self._native.held

    @property
    def kinks(self) -> list[str]:
        """Blocks that jump or have a corner right here: the derivative is that of one side."""
        return self._native.kinks

    def to_control(self) -> Any:
        """control.StateSpace of python-control, with the names."""
        import control

        def plain(names: list[str]) -> list[str]:
            return [name.replace(".", "_") for name in names]  # which python-control takes for systems

        return control.ss(
            self.A,
            self.B,
            self.C,
            self.D,
            self.period,
            states=plain(self.states),
            inputs=plain(self.inputs),
            outputs=plain(self.outputs),
        )

    def _pair(self, output: str | int, input: str | int) -> tuple[int, int]:
        def number(which: str | int, names: list[str], kind: str) -> int:
            if not isinstance(which, str):
                return which
            if which not in names:
                raise UnknownName(f"the system has no {kind} '{which}'; there are {', '.join(names)}")
            return names.index(which)

        return number(output, self.outputs, "output"), number(input, self.inputs, "input")

    def poles(self) -> NDArray[Any]:
        """Eigenvalues of A, by their real part."""
        import numpy

        return numpy.array(self._native._poles(), dtype=complex)

    def zeros(self, output: str | int = 0, input: str | int = 0) -> NDArray[Any]:
        """Where the transfer function from that input to that output is 0."""
        import numpy

        return numpy.array(self._native._zeros(*self._pair(output, input)), dtype=complex)

    def frequency_response(
        self, omega: Any = None, *, output: str | int = 0, input: str | int = 0
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """Frequencies [rad/s] and the complex response at each; without any, such that show what poles and zeros do."""
        import numpy

        pair = self._pair(output, input)
        asked = self._native._frequencies(*pair, 400, False) if omega is None else numpy.atleast_1d(omega).astype(float).tolist()
        return numpy.array(asked), numpy.array(self._native._response(*pair, asked)[0])

    def margins(self, output: str | int = 0, input: str | int = 0) -> Margins:
        """Of the loop whose gain this is, closed by negative feedback."""
        return self._native._margins(*self._pair(output, input))

    def step_response(self, duration: float = 0, *, output: str | int = 0, input: str | int = 0) -> StepResponse:
        """To a step of 1 from rest; without a duration until it has settled."""
        if not 0 <= duration < float("inf"):
            raise WrongValue(f"a response lasts 0 s, until it has settled, or longer, not {duration} s")
        return self._native._step_response(*self._pair(output, input), duration)

    # ---- pictures

    def bode(self, output: str | int = 0, input: str | int = 0) -> matplotlib.figure.Figure:
        """Magnitude [dB] and phase [degrees] over frequency."""
        figure, axes = _figure(2)
        pair = self._pair(output, input)
        omega = self._native._frequencies(*pair, 600, True)
        self._draw(axes, pair, omega)
        axes[0].set_title(self._title(*pair), fontsize=10, loc="left")
        return figure

    def _draw(self, axes: Any, pair: tuple[int, int], omega: Any, style: str = "-", label: str | None = None) -> None:
        _, magnitude, phase = self._native._response(*pair, omega)
        for axis, values, unit in zip(axes, (magnitude, phase), ("magnitude [dB]", "phase [degrees]")):
            axis.semilogx(omega, values, style, linewidth=1.2, label=label)
            axis.set_ylabel(unit)
        axes[-1].set_xlabel("frequency [rad/s]")

    def nyquist(self, output: str | int = 0, input: str | int = 0) -> matplotlib.figure.Figure:
        """The response as a curve in the complex plane, with -1 and the unit circle."""
        import numpy

        figure, (axis,) = _figure(1)
        pair = self._pair(output, input)
        value = numpy.array(self._native._response(*pair, self._native._frequencies(*pair, 3000, True))[0])
        value[abs(value) > _FARTHEST] = numpy.nan
        angle = numpy.linspace(0, 2 * numpy.pi, 200)
        axis.plot(numpy.cos(angle), numpy.sin(angle), "--", color="0.6", linewidth=0.8)
        axis.plot(value.real, value.imag, linewidth=1.2)
        axis.plot(value.real, -value.imag, linewidth=1.2, linestyle=":")
        axis.plot([-1], [0], "x", color="black")
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_title(self._title(*pair), fontsize=10, loc="left")
        axis.set_xlabel("real part")
        axis.set_ylabel("imaginary part")
        return figure

    def nichols(self, output: str | int = 0, input: str | int = 0) -> matplotlib.figure.Figure:
        """Magnitude [dB] over phase [degrees]."""
        figure, (axis,) = _figure(1)
        pair = self._pair(output, input)
        _, magnitude, phase = self._native._response(*pair, self._native._frequencies(*pair, 1500, True))
        axis.plot(phase, magnitude, linewidth=1.2)
        axis.plot([-180], [0], "x", color="black")
        axis.set_title(self._title(*pair), fontsize=10, loc="left")
        axis.set_xlabel("phase [degrees]")
        axis.set_ylabel("magnitude [dB]")
        return figure

    def root_locus(
        self, gains: Sequence[float] = (), *, output: str | int = 0, input: str | int = 0
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """Gains k, and for each of them a row of poles of the loop that is closed with k L."""
        import numpy

        used, roots = self._native._root_locus(*self._pair(output, input), list(gains))
        return numpy.array(used), numpy.array(roots)

    def _title(self, output: int, input: int) -> str:
        return f"from {self.inputs[input]} to {self.outputs[output]}"

    def __repr__(self) -> str:
        time = f"sampled at {self.period:g} s" if self.period else "continuous"
        return f"<LinearSystem: {len(self.states)} states, from {', '.join(self.inputs)} to {', '.join(self.outputs)}, {time}>"


def _figure(rows: int) -> tuple[matplotlib.figure.Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 2.4 * rows + (1.6 if rows == 1 else 0.4)), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for axis in axes:
        axis.grid(alpha=0.3, linewidth=0.6)
    return figure, axes
