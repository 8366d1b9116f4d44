"""Friction loss in pins: μ r |F| times the speed of the pin, with F computed without friction [one explicit step].

On slender pins that is close to what pins that brake each other take: at μ = 0.1 within a percent on a beat-up.
"""

from collections.abc import Mapping
from typing import Any

from pydantic import Field, create_model

from loomopt.base.quantities import PositiveLength, PureNumber
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs
from loomopt.physics.schema import Figure, Table

LOSS = "friction_loss"
FIGURE = Figure(LOSS, "power", "mean friction loss in the pins under their loads", sides=())


class Pin(Table):
    """Friction of one pin."""

    mu: PureNumber | None = Field(None, description="coefficient of friction, for the friction loss")
    radius: PositiveLength | None = Field(None, description="radius of the pin or journal")


def parameters(pins: Mapping[str, str]) -> type[Table]:
    """Table of an effect with friction in pins; pins: name → description."""
    fields = {name: (Pin | None, Field(None, description=text)) for name, text in pins.items()}
    inner = create_model("Pins", __base__=Table, __module__=__name__, __doc__="Friction of each pin.", **fields)  # type: ignore[call-overload]
    whole = (inner | None, Field(None, description="friction of the pins; it is read by friction_loss only"))
    doc = "Values that only friction_loss reads."
    model: type[Table] = create_model("Parameters", __base__=Table, __module__=__name__, __doc__=doc, pins=whole)  # type: ignore[arg-type]
    return model


def read(effect: str, pins: Mapping[str, str]) -> tuple[str, ...]:
    """Scene keys that the loss by friction reads."""
    return tuple(f"effects.{effect}.pins.{name}.{key}" for name in pins for key in Pin.model_fields)


def works(at: Inputs[Any], turned: Mapping[str, tuple[str, Number]]) -> dict[str, Number]:
    """Work of a newton of each force against friction, m per rad of the crank: μ r |δ'|.

    turned: pin → the name of its force, and δ', how the pin turns per rad of the crank.
    """
    work = {}
    for pin, (force, turn) in turned.items():
        work[force] = at.table[f"pins.{pin}.mu"] * at.table[f"pins.{pin}.radius"] * at.maths.sqrt(turn**2)
    return work
