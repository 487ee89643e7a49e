"""Runs."""

from __future__ import annotations

import atexit
import math
import os
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

from . import _native
from ._expression import real
from .errors import RunError, UnknownName, WrongValue

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._analysis import LinearSystem
    from ._measure import FrequencyResponse
    from ._tune import TunedLoop
    from ._model import LoadedModel
    from ._native import Gradient, Recorder
    from ._recording import Recording


class _Values(MutableMapping[str, Any]):
    def __delitem__(self, path: str) -> None:
        raise RunError(f"'{path}' cannot be removed from a run")

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join(list(self)[:8])}{', ...' if len(self) > 8 else ''}>"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)


class Parameters(_Values):
    """Of a run, by their paths: `sim.parameters['controller.pd.K'] = 3`. Reading gives a view that follows the run;
    `set` changes several at once, all or none. Throws WrongValue for another shape, for NaN, and for what lies outside of
    the limits that `model.parameters` shows."""

    def __init__(self, run: _native.Simulation) -> None:
        self._run = run

    def __getitem__(self, path: str) -> NDArray[Any]:
        return self._run._parameter(path)

    def __setitem__(self, path: str, value: Any) -> None:
        self.set({path: value})

    def set(self, values: Mapping[str, Any]) -> None:
        """All of them, or none where one is refused."""
        self._run._set_parameters([(path, real(value, f"'{path}'")) for path, value in values.items()], False)

    def __iter__(self) -> Iterator[str]:
        return iter(self._run._parameters())

    def __len__(self) -> int:
        return len(self._run._parameters())


class Variables(_Values):
    """Of the model, by their names: `sim.variables['Gain.Kp'] = 3` changes all parameters that follow from it, in the
    run. Throws WrongValue for a variable that is fixed, with the reason."""

    def __init__(self, run: _native.Simulation) -> None:
        self._run = run

    def __getitem__(self, name: str) -> Any:
        for known, values in self._run._variables():
            if known == name:
                return values[0] if len(values) == 1 else values
        raise UnknownName(f"the model has no variable '{name}' of numbers{_native._did_you_mean(str(name), list(self))}")

    def __setitem__(self, name: str, value: Any) -> None:
        self.set({name: value})

    def set(self, values: Mapping[str, Any]) -> None:
        """All of them, or none where one is refused."""
        for name in values:
            self[name]
        self._run._set_parameters(list(values.items()), True)

    def __iter__(self) -> Iterator[str]:
        return iter([name for name, _ in self._run._variables()])

    def __len__(self) -> int:
        return len(self._run._variables())


class Inputs(_Values):
    """Of the root, by their paths: written between two steps, they keep their value."""

    def __init__(self, run: _native.Simulation) -> None:
        self._run = run

    def __getitem__(self, path: str) -> NDArray[Any]:
        return self._run._input(path)

    def __setitem__(self, path: str, value: Any) -> None:
        self._run._set_input(path, real(value, f"'{path}'"))

    def __iter__(self) -> Iterator[str]:
        return iter(self._run._inputs())

    def __len__(self) -> int:
        return len(self._run._inputs())


#: What ends a run: a comparison, 'controller.x > 0.3', asked in every step when its outputs are there; or a function of
#: the simulation, asked after every step.
Event = Union[str, "Callable[[Simulation], object]"]


class Simulation(_native.Simulation):
    """A running model. One thread at a time steps it, and C++ computes without the GIL; several simulations do not know of
    one another. Signals are arrays: `sim['controller.tau']` is a view of what the signal is now."""

    def __init__(self, model: LoadedModel) -> None:
        super().__init__(model._native)
        self._model = model
        self._recorders: list[Recorder] = []
        _live.add(self)

    def linearize(
        self,
        from_: str | Sequence[str] = (),
        to: str | Sequence[str] = (),
        *,
        open: str | Sequence[str] = (),
        loop: str = "",
        all_states: bool = False,
    ) -> LinearSystem:
        """As `LoadedModel.linearize`, where the run is now; the run stays there. Throws RunError, also for blocks that
        cannot be saved."""
        from ._analysis import LinearSystem, options

        found = self._linearize(options(from_, to, open, loop, all_states))
        return LinearSystem(found._negative() if loop else found)

    def gradient(
        self,
        by: str | Sequence[str],
        *,
        cost: str,
        duration: float,
        at_end: bool = False,
        way: Literal["cheaper", "forward", "adjoint"] = "cheaper",
    ) -> Gradient:
        """How the cost of a run from the start changes, exactly: that of its very steps. `cost`: a signal of one element, whose
        sum over the steps of `duration` seconds is meant, each times its length, or its value `at_end`. `by`: parameters
        'block.parameter', states at the start 'block.state', and inputs of the root, which stay what they are; a vector
        stands for all of its elements. `way`: 'forward' along four parameters at a time, 'adjoint' back from the cost to
        all of them at once, or whichever is cheaper. Parameters and inputs are those of this run, which stays where it is.
        Throws RunError, which names what cannot be differentiated over a run."""
        return self._gradient(_listed(by) or [], cost, float(duration), at_end, way)

    def frequency_response(
        self,
        from_: str = "",
        to: str = "",
        *,
        omega: Any,
        loop: str = "",
        amplitude: float = 0,
        chirp: bool = False,
        tolerance: float = 1e-4,
        most_periods: int = 1000,
    ) -> FrequencyResponse:
        """Measured by running on from here, once for each frequency `omega` [rad/s], with a sine added to the signal `from_`
        until transients have died out; also where nothing can be linearised. `loop='a'` gives the gain L of the loop
        through that signal, which stays closed, as of negative feedback. `amplitude` 0: 1 % of what the signal is, at least
        0.01. `chirp`: one sweep for all frequencies. The run is afterwards where it was. Throws RunError."""
        from ._measure import measured

        return measured(self, from_, to, omega, loop, amplitude, chirp, tolerance, most_periods)

    def tune(
        self,
        loop: str,
        by: str | Sequence[str],
        *,
        crossover: float = 0,
        bandwidth: float = 0,
        phase_margin: float | None = None,
        overshoot: float | None = None,
        gain_margin: float = 0,
        open: str | Sequence[str] = (),
    ) -> TunedLoop:
        """Finds the gains `by` (a block with P and I, parameters 'block.parameter', variables) with which the `loop`
        through that signal, as of negative feedback, crosses 1 at `crossover`, or has the `bandwidth` [rad/s], with the
        `phase_margin` [degrees], 60 where nothing is said, an `overshoot` of its step of at most so many %, and at least
        the `gain_margin` [dB]; `open` names further signals that are cut. The run then has these gains, and is where it
        was. Throws RunError, which says what cannot be reached, and what can."""
        from . import _native
        from ._tune import TunedLoop

        return TunedLoop(
            _native._tune_loop(
                self,
                loop,
                _listed(by) or [],
                crossover,
                bandwidth,
                phase_margin,
                overshoot,
                gain_margin,
                _listed(open) or [],
            ),
            loop,
        )

    def loop_step(
        self, loop: str, duration: float, *, height: float = 0, open: str | Sequence[str] = ()
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """Times [s] and what comes back in a run in which a step is added at a loop, by its height, `height` 0: 1 % of
        what the signal is, at least 0.01: of a linear loop the step response of L/(1 + L). Signals that are `open`, as
        those of slower loops around this one, stay at what they are. The run is afterwards where it was."""
        import numpy

        from . import _native

        time, value = _native._simulated_step(self, loop, duration, height, _listed(open) or [])
        return numpy.array(time), numpy.array(value)

    def trim(
        self,
        free: str | Sequence[str] = (),
        *,
        hold: Mapping[str, float] | None = None,
        target: Mapping[str, float] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Finds states and `free` inputs of the root at which nothing moves and signals have their `target`, and goes there:
        what was found, and residuals, by name. `hold`: states, 'block.state', and inputs that keep a value; `bounds`: of
        free inputs and of states. As many numbers are free as there are equations. Throws RunError, which says what is
        in the way; the run then is where it was."""
        found, residuals = self._trim(
            _listed(free) or [],
            [(name, _number(name, value)) for name, value in (hold or {}).items()],
            [(name, _number(name, value)) for name, value in (target or {}).items()],
            [(name, _limits(name, value)) for name, value in (bounds or {}).items()],
        )
        return dict(found), dict(residuals)

    @property
    def model(self) -> LoadedModel:
        """That runs."""
        return self._model

    @property
    def parameters(self) -> Parameters:
        """By path, to be read and set."""
        return Parameters(self)

    @property
    def variables(self) -> Variables:
        """Of the model, by name, to be read and set."""
        return Variables(self)

    @property
    def inputs(self) -> Inputs:
        """Of the root, to be read and set."""
        return Inputs(self)

    def keys(self) -> list[str]:
        """Paths of all signals, under all their names."""
        return self._signals()

    def run(self, duration: float | None = None, *, to: float | None = None, until: Event | None = None) -> bool:
        """Steps on for `duration` seconds, to the time `to`, or to the model's own stop time. `until` ends it early: then
        it returns True. Throws StepError where a step fails; Ctrl-C ends it between two steps."""
        if until is None or isinstance(until, str):
            return self._run(duration, to, until or "")
        if duration is None and to is None and math.isinf(self.model.stop):
            duration = math.inf
        last = self._last_step(duration, to)
        while self.steps < last:
            self.step()
            if until(self):
                return True
        return False

    def record(self, signals: str | Sequence[str] | None = None) -> Recording:
        """Records in memory from now on: what the model asks for, or these signals (also patterns, 'controller.*'). The
        recording grows while the run goes on."""
        from ._recording import Recording

        recording = Recording()
        _native._record_memory(self, _listed(signals), recording._native)
        return recording

    def record_to(self, file: str | os.PathLike[str], signals: str | Sequence[str] | None = None) -> Recorder:
        """Records into an MCAP file, with all that `bf replay` needs, until it is closed:
        `with sim.record_to('run.mcap'): sim.run(10)`."""
        recorder = _native._record_file(self, Path(file), _listed(signals))
        self._recorders = [one for one in self._recorders if not one._is_closed] + [recorder]
        return recorder

    def end_record(self, recording: Recording) -> None:
        """A recording in memory grows no longer."""
        _native._end_record(self, recording._native)

    def observe(self, function: Callable[[Simulation], object]) -> Callable[[], None]:
        """Calls a function in each step when its outputs are there, and at events; what it raises ends `run`. Returns what
        ends it."""

        self._observe(function)
        return lambda: self._forget(function)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, type: object, value: object, traceback: object, /) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<Simulation of {self.model.name} at {self.time:g} s>"

    def _ipython_key_completions_(self) -> list[str]:
        return self.keys()


#: What is closed when the interpreter ends: a run that a function of the script itself observes is never freed.
_live: weakref.WeakSet[Simulation] = weakref.WeakSet()


@atexit.register
def _end() -> None:
    for sim in list(_live):
        for close in (*(recorder.close for recorder in sim._recorders), sim.stop):
            try:
                close()
            except RunError:  # another thread is in it
                pass


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise WrongValue(f"'{name}' takes a number, and not {value!r}; name its elements one by one") from None


def _limits(name: str, value: Any) -> tuple[float, float]:
    try:
        low, high = value
    except (TypeError, ValueError):
        raise WrongValue(f"the bounds of '{name}' are (lower, upper), and not {value!r}") from None
    return _number(name, low), _number(name, high)


def _listed(signals: str | Sequence[str] | None) -> list[str] | None:
    if signals is None or isinstance(signals, str):
        return signals if signals is None else [signals]
    names = list(signals) if isinstance(signals, Iterable) else [signals]
    if wrong := [one for one in names if not isinstance(one, str)]:
        raise WrongValue(f"a name is a text, and not {wrong[0]!r}")
    return names
