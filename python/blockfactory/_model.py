"""Models: as documents that are edited, and elaborated, ready to run."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from . import _native, operations
from ._expression import changes, expression, setting
from ._packages import find_robots
from .errors import FileError, UnknownName, WrongValue

if TYPE_CHECKING:
    from ._analysis import LinearSystem
    from ._measure import FrequencyResponse
    from ._native import BlockInfo, Diagnostic, Signal
    from ._sensitivity import Sensitivities
    from ._simulation import Simulation
    from ._tune import TunedLoop

T = TypeVar("T")

#: Blocks that are written in Python: classes derived from Block, and functions with @block.
Blocks = Sequence[Any]

_SHOWN = ("sizes", "types", "rates", "units")


def _show(show: str | Iterable[str]) -> list[str]:
    words = [show] if isinstance(show, str) else list(show)
    for word in words:
        if word not in _SHOWN:
            raise UnknownName(f"beside wires stands no '{word}'; known are {', '.join(_SHOWN)}")
    return words


class Named(Mapping[str, T], Generic[T]):
    """What a model has, by its path, in the order of the document; a block stands for its only port."""

    def __init__(self, kind: str, items: Mapping[str, T]) -> None:
        self._kind = kind
        self._items = items

    def __getitem__(self, path: str) -> T:
        try:
            return self._items[path]
        except KeyError:
            only = [one for one in self._items if one.rpartition(".")[0] == path]
            if len(only) == 1 and self._kind != "block":
                return self._items[only[0]]
            owners = Counter(one.rpartition(".")[0] for one in self._items if self._kind != "block")
            near = _native._did_you_mean(str(path), [*(one for one, count in owners.items() if count == 1), *self._items])
            raise UnknownName(f"there is no {self._kind} '{path}'{near}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"<{len(self)} {self._kind}s: {', '.join(list(self)[:8])}{', ...' if len(self) > 8 else ''}>"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)


class LoadedModel:
    """An elaborated model: every size, type, rate and the order are known. It does not change; `simulate` runs it, as
    often and in as many threads as you like."""

    def __init__(self, native: _native.LoadedModel, blocks: Blocks = ()) -> None:
        self._native = native
        self._python_blocks = tuple(blocks)

    @property
    def name(self) -> str:
        """Of the model."""
        return self._native.name

    @property
    def file(self) -> Path:
        """Of the model, absolute."""
        return Path(self._native.file)

    @property
    def step(self) -> float:
        """Base period [s]."""
        return self._native.step

    @property
    def stop(self) -> float:
        """How long the model says that it runs [s]; inf where it does not say."""
        return self._native.stop

    @property
    def overrides(self) -> dict[str, str]:
        """Names and expressions that it was loaded with."""
        return dict(self._native.overrides)

    @property
    def diagnostics(self) -> list[Diagnostic]:
        """What is wrong; a model of `load` has none."""
        return self._native.diagnostics

    @property
    def plots(self) -> dict[str, list[str]]:
        """Signals that the model draws, by the titles of panels."""
        return dict(self._native.plots)

    @property
    def blocks(self) -> Named[BlockInfo]:
        """Every block by its path, 'controller.pd': type, arguments, ports and parameters."""
        return Named("block", {block.path: block for block in self._native._blocks()})

    @property
    def signals(self) -> Named[Signal]:
        """Every signal by its path: shape, type, unit, meaning, period."""
        return Named("signal", {one.path: one for one in self._native._signals()})

    @property
    def parameters(self) -> Named[Signal]:
        """Every parameter by its path, with its limits."""
        return Named("parameter", {one.path: one for one in self._native._parameters()})

    @property
    def inputs(self) -> Named[Signal]:
        """Of the root: who runs the model writes them."""
        return Named("input", {one.path: one for one in self._native._inputs()})

    @property
    def outputs(self) -> Named[Signal]:
        """Of the root."""
        return Named("output", {one.path: one for one in self._native._outputs()})

    def edit(self) -> Model:
        """The document, to be edited; this model stays as it is."""
        return Model.parse(self._native.files[os.fspath(self.file)], self.file)

    def simulate(self) -> Simulation:
        """A run of this model, started: `with m.simulate() as sim: sim.run(10)`."""
        from ._simulation import Simulation

        sim = Simulation(self)
        sim.start()
        return sim

    def linearize(
        self,
        from_: str | Sequence[str] = (),
        to: str | Sequence[str] = (),
        *,
        open: str | Sequence[str] = (),
        loop: str = "",
        at: float = 0,
        all_states: bool = False,
    ) -> LinearSystem:
        """A, B, C, D by name, after `at` seconds of a run. `from_`: signals to which inputs are added (otherwise all inputs of
        the root), `to`: signals and states, 'block.state', that are looked at (otherwise all outputs of the root); 'a[3]'
        and 'a[l_knee]' are one element. `open`: signals that are cut, what reads them gets the input alone. `loop='a'` cuts
        the loop there and gives its gain L as of negative feedback, 1 + L = 0. Throws RunError."""
        from ._analysis import LinearSystem, options

        if not 0 <= at < float("inf"):
            raise WrongValue(f"a model is linearised at 0 s or later, not at {at} s")
        found = _native._linearize(self._native, options(from_, to, open, loop, all_states), at)
        return LinearSystem(found._negative() if loop else found)

    def _at(self, at: float) -> Simulation:
        """A run that is at this time."""
        if not 0 <= at < float("inf"):
            raise WrongValue(f"an operating point is at 0 s or later, not at {at} s")
        sim = self.simulate()
        if at:
            sim.run(to=at)
        return sim

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
        at: float = 0,
    ) -> FrequencyResponse:
        """As `Simulation.frequency_response`, after `at` seconds of a run."""
        with self._at(at) as sim:
            return sim.frequency_response(
                from_,
                to,
                omega=omega,
                loop=loop,
                amplitude=amplitude,
                chirp=chirp,
                tolerance=tolerance,
                most_periods=most_periods,
            )

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
        at: float = 0,
    ) -> TunedLoop:
        """As `Simulation.tune`, after `at` seconds of a run; this model keeps its gains: `bf.load` takes
        `tuned.gains` among the values that this one was loaded with."""
        with self._at(at) as sim:
            return sim.tune(
                loop,
                by,
                crossover=crossover,
                bandwidth=bandwidth,
                phase_margin=phase_margin,
                overshoot=overshoot,
                gain_margin=gain_margin,
                open=open,
            )

    def sensitivities(
        self,
        by: str | Sequence[str] = (),
        *,
        checks: str | Sequence[str] = (),
        duration: float = 0,
        difference: float = 1e-4,
    ) -> Sensitivities:
        """How near the checks of the model are to their limits, and how their values change with parameters,
        'block.parameter', and variables; with none, with all variables that a run can change. `duration` 0: until the
        model's stop. Exact where the run can be differentiated, else by central differences of that relative step, and
        the check says why. Throws RunError."""
        from ._sensitivity import Sensitivities
        from ._simulation import _listed

        return Sensitivities(
            _native._sensitivities(self._native, _listed(by) or [], _listed(checks) or [], duration, difference)
        )

    def state_space(self, path: str) -> Any:
        """A block StateSpace or DiscreteStateSpace as control.StateSpace of python-control."""
        from ._control import from_block

        return from_block(self, path)

    def generate(self, folder: str | os.PathLike[str], *, language: str = "c++") -> None:
        """Writes a project that computes what the model computes, bit for bit, in 'c++' or 'c'. Throws GenerationError, also
        for blocks that are written in Python."""
        if language not in ("c++", "c"):
            raise WrongValue(f"code is generated in 'c++' or 'c', not in '{language}'")
        self._native._require_right()
        self._native._generate(Path(folder), language == "c")

    def draw(self, system: str = "", *, show: str | Iterable[str] = (), dark: bool = False) -> Drawing:
        """A picture of a subsystem or a state machine, of the model itself without a path. `show`: what stands beside
        wires, of 'sizes', 'types', 'rates', 'units'."""
        return Drawing(self._native._draw(system, _show(show), dark))

    def _repr_svg_(self) -> str:
        return self.draw().svg

    def __repr__(self) -> str:
        wrong = f", {len(self.diagnostics)} mistakes" if self.diagnostics else ""
        return f"<LoadedModel {self.name}: {len(self.blocks)} blocks, step {self.step:g} s{wrong}>"


class Drawing:
    """A picture as SVG, which notebooks show."""

    def __init__(self, svg: str) -> None:
        self.svg = svg

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes an SVG file."""
        Path(file).write_text(self.svg, encoding="utf-8")

    def _repr_svg_(self) -> str:
        return self.svg


class Model(_native.Model):
    """The document that a person writes, as a value: blocks, connections, variables, everything in order. It is
    changed by operations, which hold or leave it as it was, and which `undo` takes back; what is renamed or removed is
    followed by all that refers to it.

        m = bf.Model("oscillator")
        m.set_variable("k", 40, minimum=0, unit="N/m")
        m.add("force", "Sum", signs="--")
        m.add("velocity", "Integrator")
        m.connect("force", "velocity")
    """

    @classmethod
    def read(cls, file: str | os.PathLike[str]) -> Model:
        """Of a YAML file. Throws ModelError, FileError."""
        model = cls("")
        model._read(Path(file))
        return model

    @classmethod
    def parse(cls, text: str, file: str | os.PathLike[str] = "model.yaml") -> Model:
        """Of YAML; `file` stands for the file in messages, and what it refers to is meant from there."""
        model = cls("")
        model._parse(text, Path(file))
        return model

    def copy(self) -> Model:
        """Another one, without the history."""
        model = type(self)("")
        model._copy(self)
        return model

    def save(self, file: str | os.PathLike[str] | None = None) -> None:
        """Writes the file whole or not at all; comments and spelling stay where nothing changed."""
        if file is not None:
            self.file = Path(file)
        self._save(self.file)

    def edit(self, *edits: operations.Operation | Mapping[str, Any] | str) -> Model:
        """Does operations, all of them or none: values of blockfactory.operations, or their JSON."""
        texts = [one if isinstance(one, str) else json.dumps(operations.to_json(one)) for one in edits]
        if len(texts) == 1:
            self._edit(texts[0])
        elif texts:
            self._edit('{"do": "batch", "operations": [' + ", ".join(texts) + "]}")
        return self

    # The operations that are wanted most, in short; the others are in blockfactory.operations.

    def add(
        self, path: str, type: str, /, *, period: Any = None, offset: Any = None, when: Any = None, doc: str = "", **settings: Any
    ) -> Model:
        """A new block of that type at a dotted path, with settings: m.add('controller.pd', 'Gain', K='Kp'). Of every block are
        `period` and `offset`, its sample time [s], `when`, the condition of a variant, and `doc`."""
        system, _, name = path.rpartition(".")
        written = [operations.Setting(key, setting(key, value)) for key, value in settings.items()]
        when, period, offset = (None if value is None else expression(value) for value in (when, period, offset))
        block = operations.Block(name, type=type, doc=doc, when=when, period=period, offset=offset, settings=written)
        return self.edit(operations.Add(system, block))

    def add_state_space(self, path: str, system: Any) -> Model:
        """A block of x' = A x + B u, y = C x + D u: a system of python-control, which may be a transfer function, or
        (A, B, C, D). One of discrete time, or (A, B, C, D, period), has that period [s]."""
        from ._control import to_block

        around, _, name = path.rpartition(".")
        return self.edit(operations.Add(around, to_block(name, system)))

    def add_subsystem(self, path: str, /, inputs: Sequence[str] = (), outputs: Sequence[str] = ()) -> Model:
        """A new virtual subsystem with these ports."""
        system, _, name = path.rpartition(".")
        content = operations.System(
            inputs=[operations.Port(port) for port in inputs], outputs=[operations.Port(port) for port in outputs]
        )
        return self.edit(operations.Add(system, operations.Block(name, system=content)))

    def remove(self, path: str) -> Model:
        """A block, a port or a signal's name, with its wires and all that refers to it."""
        return self.edit(operations.Remove(path))

    def rename(self, path: str, name: str) -> Model:
        """All that refers to it follows."""
        return self.edit(operations.Rename(path, name))

    def connect(self, source: str, *to: str, system: str = "") -> Model:
        """Wires from one end to others, written as in the file: 'pd.y', 'pd' (its only port), 'tau' (an own port)."""
        return self.edit(*(operations.Connect(system, source, end) for end in to))

    def disconnect(self, to: str, *, source: str = "", system: str = "") -> Model:
        """Removes the wire to an end."""
        return self.edit(operations.Disconnect(system, source, to))

    def set(self, path: str, /, **settings: Any) -> Model:
        """Settings of a block, m.set('pd', K=3), or of the model: m.set('', stop=10, solver='rk4'). None: as if it were
        not written."""
        return self.edit(
            *(
                operations.Set(path, name, None if value is None else setting(name, value))
                for name, value in settings.items()
            )
        )

    def set_variable(
        self,
        name: str,
        value: Any,
        *,
        system: str = "",
        minimum: Any = None,
        above: Any = None,
        maximum: Any = None,
        unit: str = "",
        doc: str = "",
    ) -> Model:
        """Declares a variable or a field of a struct, 'Gain.Kp'; None as value removes it."""
        written = None
        if value is not None:
            text = [None if limit is None else expression(limit) for limit in (minimum, above, maximum)]
            written = operations.Variable(
                name.rpartition(".")[2], expression(value), minimum=text[0], above=text[1], maximum=text[2], unit=unit, doc=doc
            )
        return self.edit(operations.SetVariable(system, name, written))

    def record(self, *paths: str) -> Model:
        """Signals, or patterns of signals, that runs record."""
        return self.edit(*(operations.Record(path) for path in paths))

    def plot(self, title: str, signals: Sequence[str] | None) -> Model:
        """A panel that runs draw; None removes it."""
        return self.edit(operations.Plot(title, None if signals is None else list(signals)))

    @property
    def blocks(self) -> Named[str]:
        """Types by paths, '' of subsystems."""
        return Named("block", dict(self._blocks()))

    def settings(self, path: str) -> dict[str, str]:
        """Of a block, as expressions."""
        self.blocks[path]
        return self._settings(path)

    def draw(
        self, system: str = "", *, show: str | Iterable[str] = (), dark: bool = False, blocks: Blocks = ()
    ) -> Drawing:
        """As LoadedModel.draw; mistakes are marked."""
        return Drawing(self._draw(system, _show(show), dark, list(blocks)))

    def _repr_svg_(self) -> str:
        return self.draw().svg

    def __repr__(self) -> str:
        return f"<Model {self.name}: {len(self.blocks)} blocks>"


def examine(
    model: str | os.PathLike[str] | Model,
    overrides: Mapping[str, Any] | None = None,
    /,
    *,
    blocks: Blocks = (),
    **variables: Any,
) -> LoadedModel:
    """As `load`, but a model that can be read and is wrong is no exception: its `diagnostics` say what is wrong, and
    what can be known is there nevertheless: sizes, types, rates."""
    find_robots()
    target = model if isinstance(model, _native.Model) else Path(model)
    if isinstance(target, Path) and not target.is_file():
        what = "it is a folder; give the name of a file" if target.is_dir() else "there is no such file"
        raise FileError(f"cannot read '{model!s}': {what}")
    return LoadedModel(_native._examine(target, changes(overrides, variables), list(blocks)), blocks)


def load(
    model: str | os.PathLike[str] | Model,
    overrides: Mapping[str, Any] | None = None,
    /,
    *,
    blocks: Blocks = (),
    **variables: Any,
) -> LoadedModel:
    """Reads and elaborates a file or a document, with other values of variables, of settings of blocks, or of the
    model's step, stop and solver:

        m = bf.load("balancing.yaml", {"Gain.Kp": 3, "controller.pd.K": [1, 2]}, scenario=2, stop=5)

    Texts are expressions of the model; `blocks` are those that are written in Python, whose type is
    'python/NAME' in the model. Throws ModelError with all that is wrong, FileError."""
    loaded = examine(model, overrides, blocks=blocks, **variables)
    loaded._native._require_right()
    return loaded
