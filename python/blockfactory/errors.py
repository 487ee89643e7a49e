"""Exceptions. What is wrong with a model is ModelError, what a run is asked for and cannot do RunError, a step that
fails StepError: the texts say what is wrong, where, the violated rule and the remedy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._native import Diagnostic


class Error(Exception):
    """Of this package."""

    def __str__(self) -> str:  # KeyError would put it in quotes
        return str(self.args[0]) if self.args else ""


class ModelError(Error, ValueError):
    """A wrong model, before its first step: all that is wrong at once."""

    def __init__(self, text: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
        super().__init__(text)
        self.diagnostics = list(diagnostics)

    def __reduce__(self) -> tuple[type[ModelError], tuple[str]]:  # its text says all that diagnostics do
        return ModelError, (str(self),)


class RunError(Error, RuntimeError):
    """A run cannot do what it is asked for."""


class StepError(RunError):
    """A step failed; the run ends there, what was recorded stays, and `restore` may go back. Where a block in Python
    raised something, that is the cause."""

    def __init__(self, text: str, time: float) -> None:
        super().__init__(text)
        self.time = time  #: of the step [s]

    def __reduce__(self) -> tuple[type[StepError], tuple[str, float]]:
        return StepError, (str(self), self.time)


class UnknownName(RunError, KeyError):
    """There is no signal, parameter, input or block of that name."""


class WrongValue(RunError, ValueError):
    """A value of another shape, or outside of its limits."""


class FileError(Error, OSError):
    """A file cannot be read or written."""


class PluginError(Error, ImportError):
    """A plugin, or the class of a block, cannot be had."""


class GenerationError(Error):
    """What code generation cannot do."""
