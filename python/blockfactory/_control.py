"""State spaces to and from python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import operations
from ._expression import expression, real
from .errors import UnknownName, WrongValue

if TYPE_CHECKING:
    from ._model import LoadedModel

_TYPES = ("StateSpace", "DiscreteStateSpace")


def to_block(name: str, system: Any) -> operations.Block:
    """A block of x' = A x + B u, y = C x + D u, or of x+ = ..., with the period of the system; a Gain of y = D u."""
    if isinstance(system, tuple):
        if len(system) not in (4, 5):
            raise WrongValue("a state space is (A, B, C, D), or (A, B, C, D, period)")
        matrices, period = system[:4], system[4] if len(system) == 5 else 0
    else:
        if not hasattr(system, "A"):
            import control

            system = control.ss(system)
        matrices, period = (system.A, system.B, system.C, system.D), system.dt
    if period is True:
        raise WrongValue("the system is of discrete time without a period; give it one")
    import numpy

    given = [real(numpy.asarray(matrix), f"matrix {name}") for name, matrix in zip("ABCD", matrices)]
    A, B, C, D = (numpy.atleast_2d(matrix.astype(float)) for matrix in given)
    n, inputs, outputs = len(A), B.shape[1], len(C)
    for name_of, matrix, shape in (("A", A, (n, n)), ("B", B, (n, inputs)), ("C", C, (outputs, n)), ("D", D, (outputs, inputs))):
        if matrix.shape != shape:
            raise WrongValue(f"{name_of} has shape {matrix.shape}, but with the other matrices it must be {shape}")
    settings = [operations.Setting(key, expression(value)) for key, value in zip("ABCD", (A, B, C, D))]
    kind = _TYPES[bool(period)]
    if n == 0:  # of which a block of a state space has one at least
        kind, settings = "Gain", [operations.Setting("multiplication", "K*u"), operations.Setting("K", expression(D))]
    return operations.Block(name, type=kind, period=expression(float(period)) if period else None, settings=settings)


def from_block(model: LoadedModel, path: str) -> Any:
    """control.StateSpace of a block."""
    import control
    import numpy

    block = model.blocks[path]
    if block.type not in _TYPES:
        raise UnknownName(f"'{path}' is of type {block.type}, not a state space")
    from ._simulation import Simulation

    values = Simulation(model).parameters
    matrices = [values[f"{path}.{name}"].copy() for name in "ABC"]
    n = matrices[0].shape[0] if matrices[0].ndim else 1
    shapes = ((n, n), (n, -1), (-1, n))
    A, B, C = (matrix.reshape(shape, order="F") for matrix, shape in zip(matrices, shapes))
    D = numpy.asarray(block.arguments.get("D", 0), dtype=float)  # an argument, as it decides the order of blocks
    D = D.reshape((len(C), B.shape[1])) if D.any() else numpy.zeros((len(C), B.shape[1]))
    return control.ss(A, B, C, D, block.period if block.type == _TYPES[1] else 0)
