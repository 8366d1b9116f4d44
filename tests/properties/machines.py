"""Random mechanisms that assemble: crank-rockers, rapier drives, roller followers, cam laws; and whole machines."""

import dataclasses
import functools
import math

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.mechanisms import cam_follower, crank_rocker, rapier_drive
from loomopt.physics.mechanisms.cam_follower import Follower
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.crank_rocker import Lengths
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley

TURN = 2 * math.pi
NEAREST = 1e-9
"""How near to a change point, as a share of the room there is, random crank-rockers come."""
PACKAGED = lo.load("rapier").mechanism
NAMES = tuple(entry.name for entry in dataclasses.fields(Dimensions))
TODAY = Dimensions(*(PACKAGED[name] for name in NAMES))
SPREAD = 0.3
CLOSEST = 0.1
"""How near crank pin B comes to rocker shaft D, as a share of rod and rocker: nearer, digits are lost."""
ROOM = 1.002
"""How much farther than needed links l5 and l6 of a random drive reach."""


def powers(least, most):
    """Return numbers whose logarithm to base 10 is spread evenly."""
    return st.floats(least, most).map(lambda power: 10.0**power)


angles = st.floats(0, TURN)
shares = st.floats(0, 1)
places = st.one_of(shares, powers(-12, -1), powers(-12, -1).map(lambda rest: 1 - rest))
"""u of a cam law, often near its ends."""
sides = st.sampled_from([1, -1])


@st.composite
def crank_rockers(draw, nearest=NEAREST):
    """Draw a crank-rocker: the frame anywhere in the room that crank, rod and rocker leave, often near its ends.

    At the ends l4 = l1 + |l2 − l3| and l4 = l2 + l3 − l1 the linkage folds flat.
    """
    l1, l2, l3 = draw(powers(-4, -0.3)), draw(st.floats(0.55, 2)), draw(st.floats(0.55, 2))
    least, most = l1 + abs(l2 - l3), l2 + l3 - l1
    share = draw(st.one_of(st.floats(0.05, 0.5), powers(math.log10(nearest), -1)))
    l4 = least + share * (most - least) if draw(st.booleans()) else most - share * (most - least)
    size = draw(powers(-2, 1))
    lengths = Lengths(l1 * size, l2 * size, l3 * size, l4 * size, draw(sides))
    assume(l4 - l1 >= CLOSEST * max(l2, l3) and crank_rocker.fault(*sides_of(lengths)) == "")
    return lengths


def sides_of(lengths):
    return lengths.l1, lengths.l2, lengths.l3, lengths.l4


@st.composite
def drives(draw):
    """Draw a drive that turns: lengths, ratios, pivots and angles within 30 % of today's."""
    # The sley and the five-bar apart: few drives turn whose sixteen numbers all move by that much at once.
    widths = dict.fromkeys(NAMES, SPREAD)
    widths |= dict.fromkeys(("l1", "l2", "l3", "l71"), draw(st.sampled_from([0.05, 0.15, SPREAD])))
    widths |= dict.fromkeys(("l5", "C0x", "C0y"), draw(st.sampled_from([0.1, SPREAD])))
    moved = {name: getattr(TODAY, name) * (1 + widths[name] * draw(st.floats(-1, 1))) for name in NAMES}
    d = Dimensions(**moved)
    assume(rapier_drive.fault(d) == "")
    base = RapierPose(systems.numpy(), d, Sley(systems.FLOAT, d).stand, np.linspace(0, TURN, 181)).base
    span = np.hypot(base.x, base.y)
    assume(span.max() * ROOM < d.l5 + d.l6 and span.min() > abs(d.l5 - d.l6) * ROOM)
    return d


@st.composite
def contacts(draw):
    """Draw a follower that can work, and φ, φ', φ'' somewhere on its swing."""
    arm, unit, inner = draw(st.floats(0.4, 2.5)), draw(powers(-2, 1)), st.floats(0.02, 0.98)
    least, most = abs(arm - 1), arm + 1
    base = least + draw(inner) * (most - least)
    start = math.acos((1 + arm**2 - base**2) / (2 * arm))
    swing = draw(inner) * (math.pi - start)
    follower = Follower(arm * unit, unit, base * unit, draw(inner) * base * unit, swing)
    assume(cam_follower.fault(follower) == "")
    return follower, (draw(shares) * swing, draw(st.floats(-2, 2)), draw(st.floats(-4, 4)))


@st.composite
def accelerations(draw):
    """Draw s'' at the knots of a spline of 2 to 24 intervals, of either sign, some of them 0."""
    count = draw(st.integers(3, 25))
    return draw(st.lists(st.floats(-30, 30).map(lambda a: round(a, 6)), min_size=count, max_size=count))


@st.composite
def tables(draw):
    """Draw the points of a rise: u and s grow by steps of which the longest is at most eight times the least."""
    count = draw(st.integers(3, 9))
    steps = st.lists(st.floats(0.25, 2), min_size=count, max_size=count)
    return growing(draw(steps)), growing(draw(steps))


def growing(steps):
    """Return 0, …, 1 that grows in proportion to the steps."""
    return tuple(math.fsum(steps[:k]) / math.fsum(steps) for k in range(len(steps) + 1))


factors = st.floats(0.2, 3)


@functools.cache
def machine(job, *effects, law=""):
    """Return today's machine with those effects on: its model and its numbers, SI; law: of the cam, or of the rod."""
    scene = lo.load(job)
    for name in effects:
        scene = scene.with_effect(name)
    if law in ("lumped", "exact"):
        scene = scene.set("effects.rod_inertia.model", law)
    elif law:
        scene = scene.set("mechanism.law", law)
    result = registry.of(scene)
    sampler = result.sampler(scene, result.today(scene))
    return sampler.model, sampler.values


def varied(draw, values, remaining=()):
    """Return numbers times random factors, 0.2 to 3; 0 stays."""
    return {name: value if name in remaining else value * draw(factors) for name, value in values.items()}


REED = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction")


@st.composite
def reeds(draw, without=()):
    """Draw a beat-up mechanism with everything on that can be, but for some effects."""
    model, values = machine("beatup", *REED, law=draw(st.sampled_from(["lumped", "exact"])))
    model = dataclasses.replace(model, effects=tuple(effect for effect in model.effects if effect.name not in without))
    values = varied(draw, values | {"m4e": 5.0, "r4e": 0.05, "gravity.offset": 0.1})
    values |= dict(zip(("l1", "l2", "l3", "l4"), sides_of(draw(crank_rockers(nearest=1e-3))), strict=True))
    return model, values | {"resistance.pulse": draw(st.floats(0.05, 1.5))}


@st.composite
def frames(draw, effects=("damping", "dry_friction")):
    """Draw a heald frame on a named law: any angles of rise, dwells and return, any masses and forces."""
    model, values = machine("shedding", *effects, law=draw(st.sampled_from(tuple(LAWS))))
    arcs = [draw(st.floats(0.2, 1)) for _ in range(4)]
    turn = dict(zip(("rise", "far_dwell", "return", "near_dwell"), arcs, strict=True))
    result = varied(draw, values, remaining=("arm", "centre_distance", "base_radius", "roller_radius"))
    return model, result | {name: TURN * arc / math.fsum(arcs) for name, arc in turn.items()}
