"""Values of Python as expressions of models."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from .errors import WrongValue


def expression(value: Any) -> str:
    """The MATLAB text of a number, a truth value, a vector or a matrix; a text is an expression already. Numbers keep
    every bit."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return "true" if value else "false"
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
        if isinstance(value, bool):
            return expression(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value):
            return "NaN"
        return repr(value) if math.isfinite(value) else ("Inf" if value > 0 else "-Inf")
    if isinstance(value, (list, tuple)):
        if any(isinstance(row, (list, tuple)) for row in value):
            if any(isinstance(item, (list, tuple)) for row in value for item in row):
                raise WrongValue("a value of a model has at most two dimensions")
            return "[" + "; ".join(" ".join(expression(item) for item in row) for row in value) + "]"
        return "[" + " ".join(expression(item) for item in value) + "]"
    raise WrongValue(f"{value!r} is no value of a model; give a number, a truth value, an array, or the text of an expression")


def real(value: Any, what: str) -> Any:
    """That value, if it has no imaginary part, which numpy would leave out."""
    if getattr(getattr(value, "dtype", None), "kind", "") == "c":
        raise WrongValue(f"{what} is real, and given complex numbers; give one of their parts")
    return value


def setting(name: str, value: Any) -> str:
    """Of a block: an expression, or a chart, which is a mapping as in a model's file."""
    if name == "chart" and isinstance(value, Mapping):
        return json.dumps(value, default=expression)
    return expression(value)


def changes(overrides: Mapping[str, Any] | None, variables: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names and expressions; a dictionary is a struct."""
    all: list[tuple[str, str]] = []

    def collect(prefix: str, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, Mapping):
                collect(f"{prefix}{name}.", value)
            else:
                all.append((prefix + name, expression(value)))

    collect("", overrides or {})
    collect("", variables)
    return all
