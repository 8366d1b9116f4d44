"""Made-up effects of the beat-up, each a torque on the reed, in scenes that pickle."""

import copy
from dataclasses import replace

from loomopt.base.quantities import Torque
from loomopt.jobs.beatup.scene import SCHEMA
from loomopt.jobs.registry import load
from loomopt.physics.effects.kinds import EffectClash, Load, ranked
from loomopt.physics.schema import Table
from loomopt.scenes.scene import build


class Parameters(Table):
    """T: a torque, N·m."""

    T: Torque


class Moving(Load):
    """Kind of effect that yields to any other."""


def push(name, rank, kind=Load, sign=1, **declared):
    """Effect that pushes the reed by a steady torque; sign: −1 for the opposite direction."""
    return kind(
        name=name,
        summary="",
        table=Parameters,
        rank=rank,
        acts="output",
        force=lambda at: sign * at.table["T"],
        **declared,
    )


EFFECTS = (
    push("push", 201),
    push("pull", 202),
    push("leaning", 203, sign=-1, companions=("push",)),
    push("lone", 204, clashes=(EffectClash("push", "both push"),)),
    push("shaft", 10, Moving, clashes=(EffectClash("push", "it bends"), EffectClash("motor", "it turns"))),
    push("motor", 11, Moving),
    push("lost", 205, companions=("nowhere",)),
    push("blind", 206, needs=("mechanism.m4",)),
)


class Jobs:
    """The beat-up with more effects."""

    known = replace(SCHEMA, effects=ranked([*SCHEMA.effects.values(), *EFFECTS]))

    def __reduce__(self):
        return Jobs, ()

    def __contains__(self, name):
        return name == "beatup"

    def names(self):
        return ("beatup",)

    def check(self, scene):
        pass

    def equations(self, scene):
        return ()

    def schema(self, job, document, effects):
        return self.known


def scene(on=(), **available):
    """Packaged beat-up with more effects in [available], T in N·m or tables; on: names of effects that are on."""
    document = copy.deepcopy(dict(load("beatup").document))
    tables = {k: {"T": f"{v} N*m"} if isinstance(v, int | float) else v for k, v in available.items()}
    document["available"] = {name: table for name, table in tables.items() if name not in on}
    document["effects"] |= {name: table for name, table in tables.items() if name in on}
    return build(document, Jobs(), "beatup.toml")
