"""Robot controllers as block diagrams: load, edit, run, record and look at models.

    import blockfactory as bf

    m = bf.load("motor.yaml", {"Gain.Kp": 0.2})
    with m.simulate() as sim:
        recording = sim.record()
        sim.run(1.2)
        print(sim["motor.omega"])
    recording.to_xarray()
"""

from __future__ import annotations

from . import operations
from ._analysis import LinearSystem
from ._block import Argument, At, Block, ContinuousState, DiscreteState, Input, Output, Parameter, Writer, block
from ._measure import FrequencyResponse
from ._model import Drawing, LoadedModel, Model, examine, load
from ._native import (
    BlockInfo,
    CheckSensitivity,
    Diagnostic,
    Gradient,
    Margins,
    Recorder,
    Signal,
    StepResponse,
    _version,
)
from ._packages import example, prefix
from ._recording import Recording, Series, read_recording
from ._sensitivity import Sensitivities
from ._simulation import Inputs, Parameters, Simulation, Variables
from ._sweep import SweepResult, SweepRow, sweep
from ._tune import TunedLoop
from .errors import (
    Error,
    FileError,
    GenerationError,
    ModelError,
    PluginError,
    RunError,
    StepError,
    UnknownName,
    WrongValue,
)

__version__: str = _version()

__all__ = [
    "Argument",
    "At",
    "Block",
    "BlockInfo",
    "CheckSensitivity",
    "ContinuousState",
    "Diagnostic",
    "DiscreteState",
    "Drawing",
    "Error",
    "FileError",
    "FrequencyResponse",
    "GenerationError",
    "Gradient",
    "Input",
    "Inputs",
    "LinearSystem",
    "LoadedModel",
    "Margins",
    "Model",
    "ModelError",
    "Output",
    "Parameter",
    "Parameters",
    "PluginError",
    "Recorder",
    "Recording",
    "RunError",
    "Sensitivities",
    "Series",
    "Signal",
    "Simulation",
    "StepError",
    "StepResponse",
    "SweepResult",
    "SweepRow",
    "TunedLoop",
    "UnknownName",
    "Variables",
    "Writer",
    "WrongValue",
    "block",
    "examine",
    "example",
    "load",
    "operations",
    "prefix",
    "read_recording",
    "sweep",
]
