"""Changes of a model, as in C++ (bf/model/operation.hpp): each is a value, each leaves the model as it was where it is
impossible, and whatever refers to what is renamed, moved or removed follows.

`path` is the dotted path of a block ('controller.pd') or of a subsystem's own port ('controller.tau'); `system` that of a
subsystem, empty for the model itself. Ends of connections are written as in the file: 'pd.u', 'pd' (its only port), 'tau'
(an own port). Expressions are texts."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Union


@dataclass(frozen=True)
class Point:
    """Of a drawing [px]: x grows to the right, y downwards."""

    x: float = 0
    y: float = 0


@dataclass(frozen=True)
class Port:
    """Of a subsystem; what it does not declare is inherited from what is connected."""

    name: str
    shape: str | None = None
    type: str = ""
    unit: str = ""
    doc: str = ""
    when_disabled: str = "held"
    each: bool = False
    initial: str | None = None


@dataclass(frozen=True)
class Setting:
    """The value of a block's argument or parameter."""

    name: str
    value: str


@dataclass(frozen=True)
class Variable:
    """A named value; with `fields` a struct."""

    name: str
    value: str = ""
    minimum: str | None = None
    above: str | None = None
    maximum: str | None = None
    unit: str = ""
    doc: str = ""
    fields: Sequence[Variable] = ()


@dataclass(frozen=True)
class Reference:
    """The content of a block that another model file holds."""

    file: str
    with_: Sequence[Variable] = ()


@dataclass(frozen=True)
class Endpoint:
    """Of a connection; without a block an own port."""

    block: str = ""
    port: str = ""


@dataclass(frozen=True)
class Connection:
    """From one output to inputs."""

    from_: Endpoint
    to: Sequence[Endpoint]


@dataclass(frozen=True)
class Block:
    """A block of a library (`type`), a subsystem (`system`) or one in its own file (`reference`)."""

    name: str
    type: str = ""
    reference: Reference | None = None
    system: System | None = None
    doc: str = ""
    when: str | None = None
    period: str | None = None
    offset: str | None = None
    settings: Sequence[Setting] = ()


@dataclass(frozen=True)
class System:
    """The content of a subsystem."""

    execution: str = "virtual"
    states: str = "held"
    trigger: str = "rising"
    reset: str | None = None
    iterations: str | None = None
    icon: str = ""
    inputs: Sequence[Port] = ()
    outputs: Sequence[Port] = ()
    variables: Sequence[Variable] = ()
    blocks: Sequence[Block] = ()
    connections: Sequence[Connection] = ()


@dataclass(frozen=True)
class Note:
    """A text or an image on a drawing."""

    name: str = ""
    text: str = ""
    image: str = ""
    system: str = ""
    at: Point = Point()
    size: Point | None = None


@dataclass(frozen=True)
class Signal:
    """A path to signals."""

    path: str


@dataclass(frozen=True)
class Display:
    """A panel in which runs are watched; `shows`: lines, xy, bars, heat_map, numbers, states."""

    name: str
    shows: str = "lines"
    signals: Sequence[Signal] = ()


@dataclass(frozen=True)
class Add:
    """A new block, at its place in the order (else last) and in the drawing."""

    system: str
    block: Block
    index: int | None = None
    at: Point | None = None


@dataclass(frozen=True)
class Remove:
    """A block or a port, its wires, and the signals under it from records and plots; or the name of a signal."""

    path: str


@dataclass(frozen=True)
class Rename:
    """A block, a port of a subsystem or a named signal."""

    path: str
    name: str


@dataclass(frozen=True)
class Reorder:
    """Another place in the order of the blocks or ports."""

    path: str
    index: int = 0


@dataclass(frozen=True)
class Connect:
    """A wire."""

    system: str
    from_: str
    to: str


@dataclass(frozen=True)
class Disconnect:
    """Removes the wire to `to`, or the one from `from_` where a variant's input has several."""

    system: str
    from_: str = ""
    to: str = ""


@dataclass(frozen=True)
class NameSignal:
    """Names the signal that comes from there."""

    system: str
    from_: str
    name: str


@dataclass(frozen=True)
class Set:
    """A setting of a block, its type as 'block', a variable of a subsystem, or what else the document says by that name:
    'period', 'doc', 'file'; 'step', 'solver' of the model (no path). None: as if it were not written."""

    path: str
    name: str
    value: str | None = None


@dataclass(frozen=True)
class AddPort:
    """A new input or output of a subsystem."""

    system: str
    port: Port
    is_output: bool = False
    index: int | None = None


@dataclass(frozen=True)
class SetVariable:
    """Declares a variable or a field of a struct, 'Gain.Kp', or removes it."""

    system: str
    name: str
    variable: Variable | None = None


@dataclass(frozen=True)
class RenameVariable:
    """A variable or an enumeration, and the expressions that use it."""

    system: str
    name: str
    to: str


@dataclass(frozen=True)
class Move:
    """Draws a block or a port at another point."""

    path: str
    to: Point


@dataclass(frozen=True)
class Resize:
    """Gives a drawn block a size, or leaves it to the editor."""

    path: str
    size: Point | None = None


@dataclass(frozen=True)
class Flip:
    """Mirrors a drawn block."""

    path: str


@dataclass(frozen=True)
class Rotate:
    """Turns a drawn block by a quarter clockwise."""

    path: str


@dataclass(frozen=True)
class PlacePort:
    """The side of a drawn block on which a port stands: left, right, top, bottom."""

    path: str
    port: str
    side: str | None = None


@dataclass(frozen=True)
class Bend:
    """The corners of the wire to the input at `path`; none: it finds its way."""

    path: str
    points: Sequence[Point] = ()


@dataclass(frozen=True)
class Label:
    """Labels at the ends of the wire to the input at `path`, instead of the wire; or the wire."""

    path: str
    is_there: bool = False


@dataclass(frozen=True)
class Annotate:
    """Writes or removes a note."""

    name: str
    note: Note | None = None


@dataclass(frozen=True)
class Group:
    """Puts blocks into a new virtual subsystem."""

    system: str
    blocks: Sequence[str]
    name: str


@dataclass(frozen=True)
class Dissolve:
    """Puts the content of a virtual subsystem in its place."""

    path: str


@dataclass(frozen=True)
class Inline:
    """Puts the content of the referenced file in its place."""

    path: str


@dataclass(frozen=True)
class Extract:
    """Puts the content of a subsystem into a model of its own; writing the file is up to the caller."""

    path: str
    file: str


@dataclass(frozen=True)
class Record:
    """Records a signal or a pattern of signals, or no longer; with `plot`, in that panel."""

    path: str
    is_recorded: bool = True
    plot: str = ""


@dataclass(frozen=True)
class Plot:
    """A panel of the plot, or none of that title."""

    title: str
    signals: Sequence[str] | None = None


@dataclass(frozen=True)
class Watch:
    """A panel in which runs are watched, or none of that name."""

    name: str
    display: Display | None = None


@dataclass(frozen=True)
class Batch:
    """Several in a row, all or none."""

    operations: Sequence[Operation] = field(default=())


Operation = Union[
    Add, Remove, Rename, Reorder, Connect, Disconnect, NameSignal, Set, AddPort, SetVariable, RenameVariable, Move, Resize,
    Flip, Rotate, PlacePort, Bend, Label, Annotate, Group, Dissolve, Inline, Extract, Record, Plot, Watch, Batch,
]  # fmt: skip

_VERBS: dict[type, str] = {
    kind: re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()
    for kind in (
        Add, Remove, Rename, Reorder, Connect, Disconnect, NameSignal, Set, AddPort, SetVariable, RenameVariable, Move,
        Resize, Flip, Rotate, PlacePort, Bend, Label, Annotate, Group, Dissolve, Inline, Extract, Record, Plot, Watch, Batch,
    )
}  # fmt: skip


def to_json(value: Any) -> Any:
    """As JSON knows it: members that have their usual value are left out."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        members: dict[str, Any] = {"do": _VERBS[type(value)]} if type(value) in _VERBS else {}
        for one in dataclasses.fields(value):
            given = getattr(value, one.name)
            if one.default is dataclasses.MISSING or given != one.default:
                members[one.name.rstrip("_")] = to_json(given)
        return members
    if isinstance(value, Mapping):
        return {name: to_json(item) for name, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [to_json(item) for item in value]
    return value
