"""Blocks that are written in Python."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Union, overload

from ._expression import real
from .errors import RunError

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: () a scalar; 3 or (3,) a vector; (3, 4) a matrix; a name stands for a length that the wiring decides, 'n+1' is one more;
#: '*' is any shape, '*a' the same for all quantities that say so.
Shape = Union[int, str, "tuple[int | str, ...]"]

_METHODS = ("output", "update", "derivative", "reset", "start", "stop")


class _Member:
    """A member of a block's class that declares something."""

    name = ""
    role = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: type) -> Any:
        return self


class Argument(_Member):
    """A value fixed when the block is made: a number, a truth value, a text or an array, of the kind of its default. In the
    block it is `self.NAME`, and it may decide nothing but what methods do: ports are the class's."""

    role = "argument"

    def __init__(
        self,
        default: Any,
        *,
        doc: str = "",
        minimum: float = float("-inf"),
        above: float = float("-inf"),
        maximum: float = float("inf"),
        choices: tuple[str, ...] = (),
    ) -> None:
        self.default, self.doc, self.choices = default, doc, choices
        self.minimum, self.above, self.maximum = minimum, above, maximum

    def __get__(self, instance: object, owner: type) -> Any:
        return self if instance is None else instance.__dict__[self.name]


def _initial(values: Any) -> list[float]:
    """Column by column; a list of rows is a matrix."""
    import numpy

    return [float(x) for x in numpy.asarray(values, dtype=float).ravel(order="F")]


def _check(shape: Shape) -> None:
    axes = shape if isinstance(shape, tuple) else (shape,)
    if len(axes) > 2:
        raise ValueError(f"a quantity is a scalar, a vector or a matrix, and has no shape {shape}")
    for axis in axes:
        is_length = isinstance(axis, int) and not isinstance(axis, bool)
        if not is_length and not (isinstance(axis, str) and re.fullmatch(r"\*\w*|[A-Za-z]\w*\s*(\+\s*\d+)?", axis.strip())):
            raise ValueError(f"{axis!r} is no length; write a number, a name for what the wiring decides, 'n+1', or '*'")


class _Quantity(_Member):
    def __init__(
        self,
        shape: Shape = (),
        *,
        dtype: str = "double",
        unit: str = "",
        doc: str = "",
        initial: float | tuple[float, ...] | list[float] = (),
        minimum: float = float("-inf"),
        above: float = float("-inf"),
        maximum: float = float("inf"),
        optional: bool = False,
        feedthrough: bool = True,
    ) -> None:
        self.shape, self.dtype, self.unit, self.doc = shape, dtype, unit, doc
        self.initial = _initial(initial)
        _check(shape)
        self.minimum, self.above, self.maximum = minimum, above, maximum
        self.optional, self.feedthrough = optional, feedthrough

    @property
    def lengths(self) -> list[tuple[str, int]]:
        """Each axis as the name of a length, '' for none, and what is added to it."""
        axes = self.shape if isinstance(self.shape, tuple) else (self.shape,)
        lengths = []
        for axis in axes:
            if isinstance(axis, int):
                lengths.append(("", axis))
            else:
                length, _, more = axis.partition("+")
                lengths.append((length.strip(), int(more or 0)))
        return lengths


class Input(_Quantity):
    """What comes in; `optional`: may stay unconnected and reads `initial`; `feedthrough=False`: `output` does not read it,
    so that it may come from a loop."""

    role = "input"


class Output(_Quantity):
    """What `output` writes."""

    role = "output"


class Parameter(_Quantity):
    """May change between steps, within its limits; `initial` is its default."""

    role = "parameter"


class DiscreteState(_Quantity):
    """What `update` writes, part of snapshots."""

    role = "discrete_state"


class ContinuousState(_Quantity):
    """What a solver integrates; `derivative` writes its rate."""

    role = "continuous_state"


class At:
    """What a block reads: at.u of an input, an output that is computed already, a parameter or a state, as an array that
    the next step changes. Also at.time [s], at.period [s] and at.step, how often the block ran before."""

    time: float
    period: float
    step: int

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.__dict__.update(arrays)

    def __getattr__(self, name: str) -> NDArray[Any]:
        raise AttributeError(f"the block has no '{name}'; it has {', '.join(self.__dict__)}")

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(
            f"'{name}' is read here; write outputs by out, states by next, rate and after, what else lasts by self"
        )


class Writer:
    """What a block writes: out.y = value, for all elements at once or of its shape, or out.y[2] = value."""

    _arrays: Mapping[str, NDArray[Any]]

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        object.__setattr__(self, "_arrays", arrays)

    def __getattr__(self, name: str) -> NDArray[Any]:
        try:
            return self._arrays[name]
        except KeyError:
            raise self._unknown(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        array = self._arrays.get(name)
        if array is None:
            raise self._unknown(name)
        if value is None:  # which numpy takes for NaN
            raise TypeError(f"'{name}' is given None; write numbers, or return them")
        real(value, f"'{name}'")
        try:
            array[...] = value
        except (TypeError, ValueError) as error:
            raise type(error)(f"'{name}' has shape {array.shape}: {error}") from None

    def _unknown(self, name: str) -> AttributeError:
        return AttributeError(f"here is no '{name}' to write; there is {', '.join(self._arrays) or 'nothing'}")


class Block:
    """A block in Python, for prototypes: each call costs a microsecond or two, and generated code refuses it by name. Its
    members declare, its methods compute, as in C++:

        class LowPass(bf.Block):
            "First-order low-pass filter."
            u = bf.Input("n", doc="signal to filter")
            y = bf.Output("n", doc="filtered signal")
            a = bf.Parameter(initial=0.9, minimum=0, maximum=1, doc="pole")
            x = bf.DiscreteState("n", doc="last output")

            def output(self, at, out):
                out.y = at.a * at.x + (1 - at.a) * at.u

            def update(self, at, next):
                next.x = at.y

        m = bf.load("m.yaml", blocks=[LowPass])     # there: {block: python/LowPass, a: 0.5}

    One object may serve several runs at once, and snapshots know only states: what changes in a run belongs into states. What
    a method raises ends the run, with the block's path."""

    _members: ClassVar[dict[str, _Member]] = {}
    _overrides: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        members: dict[str, _Member] = {}
        for base in reversed(cls.__mro__):
            for name, value in vars(base).items():
                if isinstance(value, _Member):
                    members[name] = value
                else:
                    members.pop(name, None)
        for name in members.keys() & {"time", "period", "step"}:
            raise TypeError(f"{cls.__name__}: '{name}' is what a block reads of the time; call the member otherwise")
        cls._members = members
        cls._overrides = tuple(name for name in _METHODS if getattr(cls, name) is not getattr(Block, name))

    def output(self, at: At, out: Writer, /) -> None:
        """Outputs of inputs, states and parameters."""

    def update(self, at: At, next: Writer, /) -> None:
        """Next discrete states; what is not written keeps its value."""

    def derivative(self, at: At, rate: Writer, /) -> None:
        """Derivatives of continuous states [1/s]."""

    def reset(self, at: At, after: Writer, /) -> None:
        """Initial states, after the declared ones were set."""

    def start(self, at: At, /) -> None:
        """Before the first step; may raise."""

    def stop(self, at: At, /) -> None:
        """After the last one."""


Function = Callable[..., Any]


@overload
def block(function: Function, /) -> type[Block]: ...
@overload
def block(
    *,
    inputs: Mapping[str, Shape | Input] | None = None,
    outputs: Mapping[str, Shape | Output] | None = None,
    name: str = "",
) -> Callable[[Function], type[Block]]: ...


def block(
    function: Function | None = None,
    /,
    *,
    inputs: Mapping[str, Shape | Input] | None = None,
    outputs: Mapping[str, Shape | Output] | None = None,
    name: str = "",
) -> type[Block] | Callable[[Function], type[Block]]:
    """A block of a plain function, without states: its arguments are inputs, of any shape, those behind `*` with a default are
    parameters; what it returns is the output `y`, of the shape of the first input, or a tuple of the named outputs:

        @bf.block
        def Cubed(u, *, gain=1.0):
            return gain * u**3

        @bf.block(inputs={"x": 3}, outputs={"norm": (), "unit": 3})
        def Direction(x): ...
    """

    def make(function: Function) -> type[Block]:
        members: dict[str, Any] = {}
        arguments: list[str] = []
        parameters: list[str] = []
        for argument in inspect.signature(function).parameters.values():
            if argument.kind is argument.KEYWORD_ONLY:
                if argument.default is argument.empty:
                    raise RunError(f"{function.__name__}: the parameter '{argument.name}' needs a default")
                members[argument.name] = _parameter(argument.default)
                parameters.append(argument.name)
            elif argument.kind in (argument.POSITIONAL_ONLY, argument.POSITIONAL_OR_KEYWORD):
                shape = (inputs or {}).get(argument.name, "*" if arguments else "*first")
                members[argument.name] = shape if isinstance(shape, Input) else Input(shape)
                arguments.append(argument.name)
            else:
                raise RunError(f"{function.__name__}: '*{argument.name}' is no input; name each of them")
        for unknown in set(inputs or {}) - set(arguments):
            raise RunError(f"{function.__name__} has no argument '{unknown}'")
        results = dict(outputs) if outputs else {"y": members[arguments[0]].shape if arguments else ()}
        for output, made in results.items():
            members[output] = made if isinstance(made, Output) else Output(made)

        def call(self: Block, at: At, out: Writer, /) -> None:
            value = function(*(getattr(at, a) for a in arguments), **{p: getattr(at, p) for p in parameters})
            if len(results) == 1:
                value = (value,)
            elif not isinstance(value, (tuple, list)) or len(value) != len(results):
                raise ValueError(f"the function returned {value!r:.80}, not a tuple of {', '.join(results)}")
            for output, one in zip(results, value):
                setattr(out, output, one)

        members["output"] = call
        members["__doc__"] = function.__doc__ or ""
        members["__module__"] = function.__module__
        return type(name or function.__name__, (Block,), members)

    return make if function is None else make(function)


def _parameter(default: Any) -> Parameter:
    import numpy

    values = numpy.asarray(default, dtype=float)
    return Parameter(values.shape, initial=values.ravel(order="F").tolist())
