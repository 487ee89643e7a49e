"""Gains of a loop, found for requirements."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._analysis import LinearSystem, _figure

if TYPE_CHECKING:
    import matplotlib.figure

    from . import _native
    from ._native import Margins, StepResponse


class TunedLoop:
    """Gains, and what the loop is before and after: `bf.load(file, tuned.gains)` loads a model with them."""

    def __init__(self, native: _native._TunedLoop, name: str) -> None:
        self.name: str = name
        self.gains: dict[str, float] = {gain: after for gain, _, after in native.gains}
        self.gains_before: dict[str, float] = {gain: before for gain, before, _ in native.gains}
        self.loop: LinearSystem = LinearSystem(native.loop)
        self.loop_before: LinearSystem = LinearSystem(native.loop_before)
        self.margins: Margins = native.margins
        self.margins_before: Margins = native.margins_before
        self.step: StepResponse = native.step
        self.step_before: StepResponse = native.step_before

    def bode(self) -> matplotlib.figure.Figure:
        """Magnitude [dB] and phase [degrees] of the loop over frequency [rad/s], before and after."""
        figure, axes = _figure(2)
        omega = self.loop._native._frequencies(0, 0, 600, True)
        for system, style, label in ((self.loop_before, "--", "before"), (self.loop, "-", "after")):
            system._draw(axes, (0, 0), omega, style, label)
        axes[0].plot([self.margins.gain_crossover], [0], "o", markersize=4)
        axes[0].set_title(f"loop through {self.name}", fontsize=10, loc="left")
        axes[0].legend(fontsize=8)
        return figure

    def __repr__(self) -> str:
        gains = ", ".join(f"{name} = {value:.6g}" for name, value in self.gains.items())
        return f"<TunedLoop through {self.name}: {gains}>"
