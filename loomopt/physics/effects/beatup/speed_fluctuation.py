"""Speed of the crank over the turn, as every linkage has it, with the speed at front dead centre."""

from dataclasses import replace
from typing import TYPE_CHECKING

from loomopt.physics.effects import speed_fluctuation
from loomopt.physics.effects.kinds import Inputs
from loomopt.physics.schema import Figure

if TYPE_CHECKING:
    from loomopt.physics.motion.turning import CrankTurn


def speed_fdc(at: Inputs[object], turning: "CrankTurn") -> float:
    """ω(β), rad/s."""
    return turning.speed(float(at.values["beta"]))


FIGURE = Figure("speed_fdc", "angular speed", "speed of the crank at front dead centre")
FLUCTUATION, *OTHERS = speed_fluctuation.EFFECT.figures
EFFECT = replace(
    speed_fluctuation.EFFECT,
    rows={**speed_fluctuation.EFFECT.rows, FIGURE.name: speed_fdc},
    figures=(FLUCTUATION, FIGURE, *OTHERS),
)
