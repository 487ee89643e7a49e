"""Sensitivities of a model's checks to its parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from . import _native
    from ._native import CheckSensitivity


class Sensitivities:
    """Of checks, by name, those nearest to their limits first, to the numbers `names`, whose values are `at`."""

    def __init__(self, native: _native._Sensitivities) -> None:
        self.names: list[str] = native.names
        self.at: NDArray[Any] = native.at
        self.checks: dict[str, CheckSensitivity] = {check.name: check for check in native.checks}

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each check and number."""
        import pandas

        rows = [
            (
                check.name,
                name,
                at,
                check.value,
                check.distance,
                check.slopes[i],
                check.distance_slopes[i],
                check.changes_to_limit[i],
                not check.differenced,
            )
            for check in self.checks.values()
            for i, (name, at) in enumerate(zip(self.names, self.at))
        ]
        columns = ["check", "by", "at", "value", "distance", "slope", "distance_slope", "change_to_limit", "is_exact"]
        return pandas.DataFrame(rows, columns=columns)

    def __repr__(self) -> str:
        return f"<Sensitivities of {len(self.checks)} checks to {len(self.names)} numbers>"
