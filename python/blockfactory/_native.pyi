from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from collections.abc import Sequence
import os
import pathlib
from typing import Annotated, overload

import numpy
from numpy.typing import NDArray


def _version() -> str:
    """That of the library."""

def _did_you_mean(name: str, known: Sequence[str]) -> str:
    """What follows a message about an unknown name."""

class Diagnostic:
    """One thing that is wrong with a model: where, what, and what to do."""

    @property
    def file(self) -> str | None:
        """The file; None for what a program made."""

    @property
    def line(self) -> int:
        """From 1; 0: it stands in no file."""

    @property
    def column(self) -> int:
        """From 1."""

    @property
    def path(self) -> str:
        """Dotted path of the block; empty for the model itself."""

    @property
    def message(self) -> str:
        """What is wrong, with the value and the violated rule."""

    @property
    def remedy(self) -> str:
        """What to do; may be empty."""

    @property
    def fixes(self) -> list[tuple[str, str]]:
        """
        What would mend it: titles, and operations for Model.edit in their text form.
        """

    @property
    def is_open(self) -> bool:
        """Is it a port that has no wire yet?"""

    def __str__(self) -> str: ...

    def __repr__(self) -> str: ...

class Signal:
    """
    What a model says of a signal, a parameter or a state: its shape, unit and meaning.
    """

    @property
    def path(self) -> str:
        """As recordings call it: 'controller.tau'."""

    @property
    def shape(self) -> tuple[int, ...] | None:
        """
        () of a scalar, (n,), or (rows, columns); None where a wrong model does not say.
        """

    @property
    def dtype(self) -> str | None:
        """
        As numpy calls it: 'float64', 'bool'; None where a wrong model does not say.
        """

    @property
    def unit(self) -> str:
        """'N.m', 'rad'; empty for none."""

    @property
    def doc(self) -> str:
        """What it is, in a sentence."""

    @property
    def period(self) -> float:
        """Between two samples [s]; 0: continuous or constant."""

    @property
    def element_names(self) -> list[str]:
        """Of a vector, such as joints; empty where its elements have no names."""

    @property
    def value_names(self) -> list[tuple[float, str]]:
        """Names of values, as of an enumeration."""

    @property
    def minimum(self) -> float:
        """Of every element of a parameter; -inf: any."""

    @property
    def above(self) -> float:
        """Every element of a parameter is greater than this; -inf: any."""

    @property
    def maximum(self) -> float:
        """Of every element of a parameter; inf: any."""

    @property
    def at_least(self) -> str:
        """
        Path of the parameter that no element of this one is below; empty: none.
        """

    def __repr__(self) -> str: ...

class BlockInfo:
    """A block of an elaborated model."""

    @property
    def path(self) -> str:
        """'controller.pd'"""

    @property
    def type(self) -> str:
        """'Gain', 'WholeBodyToolbox/MassMatrix'"""

    @property
    def library(self) -> str:
        """The plugin that has it; empty for a standard block."""

    @property
    def doc(self) -> str:
        """What the model says of it."""

    @property
    def where(self) -> str:
        """'file:line:column'"""

    @property
    def period(self) -> float:
        """Between two hits [s]; 0: continuous, inf: constant, NaN: not known."""

    @property
    def arguments(self) -> dict[str, object]:
        """The values that it was made with."""

    @property
    def inputs(self) -> dict[str, Signal]:
        """By their names."""

    @property
    def outputs(self) -> dict[str, Signal]:
        """By their names."""

    @property
    def parameters(self) -> dict[str, Signal]:
        """By their names."""

    @property
    def discrete_states(self) -> dict[str, Signal]:
        """By their names."""

    @property
    def continuous_states(self) -> dict[str, Signal]:
        """By their names."""

    def __repr__(self) -> str: ...

class Model:
    def __init__(self, name: str, file: str | os.PathLike[str] = ...) -> None: ...

    def _read(self, file: str | os.PathLike[str]) -> None: ...

    def _parse(self, text: str, file: str | os.PathLike[str]) -> None: ...

    def _copy(self, other: Model) -> None: ...

    def _edit(self, operation: str) -> None:
        """Does the operation of that text."""

    def undo(self) -> bool:
        """Takes back the last edit; False where there is none."""

    def redo(self) -> bool:
        """Does again what was taken back; False where there is none."""

    @property
    def file(self) -> pathlib.Path:
        """That the model stands for: what it refers to is meant from there."""

    @file.setter
    def file(self, arg: str | os.PathLike[str], /) -> None: ...

    @property
    def name(self) -> str: ...

    @property
    def text(self) -> str:
        """As YAML; what did not change keeps its bytes."""

    def _save(self, file: str | os.PathLike[str]) -> None: ...

    def _blocks(self) -> list[tuple[str, str]]:
        """Paths and types, '' of subsystems, in the order of the document."""

    def _settings(self, path: str) -> dict[str, str]: ...

    def __eq__(self, other: object, /) -> bool: ...

    def _draw(self, system: str, show: Sequence[str], dark: bool, blocks: Sequence[object]) -> str: ...

class LoadedModel:
    @property
    def name(self) -> str: ...

    @property
    def file(self) -> pathlib.Path:
        """Of the model."""

    @property
    def step(self) -> float:
        """Base period [s]."""

    @property
    def stop(self) -> float:
        """How long the model says that it runs [s]; inf where it does not say."""

    @property
    def diagnostics(self) -> list[Diagnostic]:
        """What is wrong; a model with any cannot be run."""

    @property
    def files(self) -> dict[str, str]:
        """Texts of the model and of all files that it refers to, by their paths."""

    @property
    def overrides(self) -> list[tuple[str, str]]:
        """Names and expressions that were changed."""

    @property
    def plots(self) -> list[tuple[str, list[str]]]:
        """Titles of panels, and the signals that the model draws there."""

    def _generate(self, folder: str | os.PathLike[str], c: bool) -> None: ...

    def _require_right(self) -> None: ...

    def _blocks(self) -> list[BlockInfo]: ...

    def _signals(self) -> list[Signal]: ...

    def _recorded(self) -> list[Signal]: ...

    def _inputs(self) -> list[Signal]: ...

    def _outputs(self) -> list[Signal]: ...

    def _parameters(self) -> list[Signal]: ...

    def _draw(self, system: str, show: Sequence[str], dark: bool) -> str: ...

def _operation(text: str) -> str:
    """The operation of that text, as text again."""

_operations: int = 28

@overload
def _examine(file: str | os.PathLike[str], changes: Sequence[tuple[str, str]], blocks: Sequence[object]) -> LoadedModel: ...

@overload
def _examine(document: Model, changes: Sequence[tuple[str, str]], blocks: Sequence[object]) -> LoadedModel: ...

class Recording:
    def __init__(self) -> None: ...

    def _names(self) -> list[str]: ...

    def _number(self, name: str) -> int: ...

    def _values(self, number: int) -> NDArray[Any]: ...

    def _nanoseconds(self, number: int) -> NDArray[Any]: ...

    def _info(self, number: int) -> dict[str, Any]: ...

    @property
    def complete(self) -> bool:
        """
        False of a file that was cut or damaged: then the rest is what could be read.
        """

    @property
    def defect(self) -> str:
        """What was found wrong."""

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """Sets of texts by their names: model, overrides, plots."""

    @property
    def attachments(self) -> dict[str, bytes]:
        """Files in the recording by their names: the model's texts, snapshots."""

class Recorder:
    """Writes what a run does to an MCAP file, until it is closed."""

    @property
    def file(self) -> pathlib.Path: ...

    @property
    def _is_closed(self) -> bool: ...

    def close(self) -> None:
        """
        Completes the file. Throws RunError when something could not be written.
        """

    def checkpoint(self) -> None:
        """Adds a snapshot of the run, from which a replay can begin."""

    def __enter__(self) -> Recorder: ...

    def __exit__(self, type: object, value: object, traceback: object, /) -> None: ...

def _record_file(simulation: object, file: str | os.PathLike[str], signals: Sequence[str] | None) -> Recorder: ...

def _record_memory(simulation: Simulation, signals: Sequence[str] | None, into: object) -> None: ...

def _end_record(simulation: Simulation, recording: Recording) -> None: ...

def _load_recording(file: str | os.PathLike[str], into: Recording) -> None: ...

class Margins:
    """
    Of a loop that is closed by negative feedback, 1 + L = 0; inf: there is none.
    """

    @property
    def gain(self) -> float:
        """By which L may be multiplied until the loop is unstable, > 1."""

    @property
    def gain_reduction(self) -> float:
        """The greatest factor < 1 that makes it unstable; 0: none does."""

    @property
    def phase(self) -> float:
        """
        That L may lose, or must gain where it is negative [degrees]; the least of all crossovers.
        """

    @property
    def delay(self) -> float:
        """That L may get [s]."""

    @property
    def modulus(self) -> float:
        """Least distance of L from -1."""

    @property
    def phase_crossover(self) -> float:
        """Where L is negative real, of `gain` [rad/s]; may be 0 or infinite."""

    @property
    def reduction_crossover(self) -> float:
        """The same of `gain_reduction` [rad/s]."""

    @property
    def gain_crossover(self) -> float:
        """Where |L| = 1, of `phase` [rad/s]."""

    @property
    def bandwidth(self) -> float:
        """Of L/(1 + L): where it first is 3 dB below its value at 0 [rad/s]."""

    @property
    def is_stable(self) -> bool:
        """Is the closed loop?"""

    def __repr__(self) -> str: ...

class StepResponse:
    """Of a step of 1 at 0 s, from rest."""

    @property
    def _time(self) -> list[float]: ...

    @property
    def _value(self) -> list[float]: ...

    @property
    def final(self) -> float:
        """Value that it comes to; nan of an unstable system."""

    @property
    def overshoot(self) -> float:
        """% of `final`; nan where that is 0."""

    @property
    def peak(self) -> float:
        """The extreme on the side of `final`."""

    @property
    def peak_time(self) -> float:
        """[s]"""

    @property
    def undershoot(self) -> float:
        """How far it goes to the other side of 0 [% of `final`]."""

    @property
    def undershoot_time(self) -> float:
        """[s]"""

    @property
    def rise_time(self) -> float:
        """From 10 % to 90 % of `final` [s]."""

    @property
    def settling_time(self) -> float:
        """
        After which it stays within 2 % of `final`, or of its largest value where that is 0 [s]; nan: not within its time.
        """

class Gradient:
    """
    How what a run costs changes with parameters, initial states and inputs.
    """

    @property
    def cost(self) -> float:
        """Of the run."""

    @property
    def names(self) -> list[str]:
        """One per element: 'controller.lqr.K[1][2]'."""

    @property
    def at(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Their values."""

    @property
    def slopes(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Derivatives of the cost by each."""

    @property
    def has_corner(self) -> bool:
        """
        A comparison met its limit on the way: the gradient is that of one side.
        """

    @property
    def is_adjoint(self) -> bool:
        """
        It was found back from the cost to all parameters at once, else forward.
        """

    @property
    def differenced(self) -> list[str]:
        """
        Paths of blocks that went in by central differences of single calls; none: it is exact.
        """

    def __repr__(self) -> str: ...

class _LinearizeOptions:
    def __init__(self, from_: Sequence[str], to: Sequence[str], open: Sequence[str], all_states: bool, by_differences: bool) -> None: ...

class LinearSystem:
    @property
    def A(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]: ...

    @property
    def B(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]: ...

    @property
    def C(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]: ...

    @property
    def D(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]: ...

    @property
    def x(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def u(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def y(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def states(self) -> list[str]: ...

    @property
    def inputs(self) -> list[str]: ...

    @property
    def outputs(self) -> list[str]: ...

    @property
    def input_units(self) -> list[str]: ...

    @property
    def output_units(self) -> list[str]: ...

    @property
    def period(self) -> float: ...

    @property
    def time(self) -> float: ...

    @property
    def differenced(self) -> list[str]: ...

    @property
    def held(self) -> list[str]: ...

    @property
    def kinks(self) -> list[str]: ...

    def _poles(self) -> list[complex]: ...

    def _zeros(self, output: int, input: int) -> list[complex]: ...

    def _frequencies(self, output: int, input: int, count: int, of_loop: bool) -> list[float]: ...

    def _response(self, output: int, input: int, omega: Sequence[float]) -> tuple[list[complex], list[float], list[float]]: ...

    def _margins(self, output: int, input: int) -> Margins: ...

    def _step_response(self, output: int, input: int, duration: float) -> StepResponse: ...

    def _root_locus(self, output: int, input: int, gains: Sequence[float]) -> tuple[list[float], list[list[complex]]]: ...

    def _negative(self) -> LinearSystem: ...

def _linearize(model: LoadedModel, options: _LinearizeOptions, time: float) -> LinearSystem: ...

class _MeasuredResponse:
    @property
    def input(self) -> str: ...

    @property
    def output(self) -> str: ...

    @property
    def input_unit(self) -> str: ...

    @property
    def output_unit(self) -> str: ...

    @property
    def amplitude(self) -> float: ...

    @property
    def time(self) -> float: ...

    @property
    def omega(self) -> list[float]: ...

    @property
    def value(self) -> list[complex]: ...

    @property
    def magnitude(self) -> list[float]: ...

    @property
    def phase(self) -> list[float]: ...

    @property
    def coherence(self) -> list[float]: ...

    @property
    def distortion(self) -> list[float]: ...

    @property
    def unsettled(self) -> list[float]: ...

def _measure_response(run: Simulation, from_: str, to: str, loop: str, omega: Sequence[float], amplitude: float, is_chirp: bool, tolerance: float, most_periods: int) -> _MeasuredResponse: ...

class _TunedLoop:
    @property
    def gains(self) -> list[tuple[str, float, float]]: ...

    @property
    def loop_before(self) -> LinearSystem: ...

    @property
    def loop(self) -> LinearSystem: ...

    @property
    def margins_before(self) -> Margins: ...

    @property
    def margins(self) -> Margins: ...

    @property
    def step_before(self) -> StepResponse: ...

    @property
    def step(self) -> StepResponse: ...

def _tune_loop(run: Simulation, loop: str, by: Sequence[str], crossover: float, bandwidth: float, phase_margin: float | None, overshoot: float | None, gain_margin: float, open: Sequence[str]) -> _TunedLoop: ...

def _simulated_step(run: Simulation, loop: str, duration: float, height: float, open: Sequence[str]) -> tuple[list[float], list[float]]: ...

class CheckSensitivity:
    """How near a check is to its limits, and what takes it there."""

    @property
    def name(self) -> str:
        """Of the block."""

    @property
    def value(self) -> float:
        """That it reports at the end of the run."""

    @property
    def at_least(self) -> float:
        """Its lower limit; -inf: none."""

    @property
    def at_most(self) -> float:
        """Its upper limit; inf: none."""

    @property
    def passed(self) -> bool:
        """Is the value within its limits?"""

    @property
    def distance(self) -> float:
        """To the nearer limit, negative beyond it; inf: there is none."""

    @property
    def slopes(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Of the value by each number."""

    @property
    def distance_slopes(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Of the distance by each number; 0 without a limit."""

    @property
    def changes_to_limit(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """
        Of each number, the change that takes the distance to 0 if it goes on as it begins; inf: none does.
        """

    @property
    def differenced(self) -> str:
        """Why slopes are differences of runs; empty: they are exact."""

    @property
    def has_corner(self) -> bool:
        """A jump or corner was met on the way: slopes are those of one side."""

class _Sensitivities:
    @property
    def names(self) -> list[str]: ...

    @property
    def at(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def checks(self) -> list[CheckSensitivity]: ...

def _sensitivities(model: LoadedModel, by: Sequence[str], checks: Sequence[str], duration: float, difference: float) -> _Sensitivities: ...

class Simulation:
    def __init__(self, model: LoadedModel) -> None: ...

    def start(self) -> None:
        """Begins anew, at 0 s. Throws RunError where a device cannot be opened."""

    def stop(self) -> None:
        """Closes devices and puts actuators back; signals keep their values."""

    @overload
    def step(self) -> None:
        """One base step. Throws StepError."""

    @overload
    def step(self, count: int) -> None:
        """So many base steps."""

    def _last_step(self, duration: float | None, time: float | None) -> int: ...

    def _run(self, duration: float | None = None, time: float | None = None, until: str = '') -> bool: ...

    @property
    def time(self) -> float:
        """Of the next step [s]."""

    @property
    def steps(self) -> int:
        """That were done."""

    @property
    def period(self) -> float:
        """Of a base step [s]."""

    @property
    def failure(self) -> str:
        """'block: message' of a step that failed, else empty."""

    @property
    def checks(self) -> dict[str, bool | float]:
        """What the model's check blocks say now."""

    def __getitem__(self, path: str, /) -> NDArray[Any]:
        """
        What the signal is now: a view that follows the run, keeps it alive, and cannot be written. () of a scalar, (n,), or (rows, columns).
        """

    def __contains__(self, path: object, /) -> bool: ...

    def _linearize(self, options: _LinearizeOptions) -> LinearSystem: ...

    def _gradient(self, by: Sequence[str], cost: str, duration: float, at_end: bool, way: str) -> Gradient: ...

    def _trim(self, free: Sequence[str], hold: Sequence[tuple[str, float]], target: Sequence[tuple[str, float]], bounds: Sequence[tuple[str, tuple[float, float]]]) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]: ...

    def _signals(self) -> list[str]: ...

    def _inputs(self) -> list[str]: ...

    def _parameters(self) -> list[str]: ...

    def _parameter(self, path: str) -> NDArray[Any]: ...

    def _input(self, path: str) -> NDArray[Any]: ...

    def _set_parameters(self, values: Sequence[tuple[str, object]], are_variables: bool) -> None: ...

    def _set_input(self, path: str, value: object) -> None: ...

    def _variables(self) -> list[tuple[str, list[float]]]: ...

    def snapshot(self) -> bytes:
        """
        All that the run needs to go on bit for bit, as the content of a snapshot file. Throws RunError where a block cannot be saved.
        """

    def restore(self, snapshot: bytes) -> None:
        """
        Goes on from there, also after a failure. Throws RunError for a snapshot of another model.
        """

    def _observe(self, function: object) -> None: ...

    def _forget(self, function: object) -> None: ...

def _sweep(file: str, texts: dict[str, str], axes: list[tuple[str, list[str]]], changes: list[tuple[str, str]], finals: list[str], jobs: int, progress: Callable[[int, int], bool]) -> list[Any]: ...
