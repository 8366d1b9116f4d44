"""Dead centres of crank-rocker groups: the closed form against the scan, Newton's method and 40 digits."""

import math

import numpy as np
import pytest
from support.linkage_scenes import FOUR_BAR, changed, four_bar

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.linkage.model import Linkage, event_value, linkage_of
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.balance import Given
from loomopt.physics.mechanisms.dead_centres import crank_rockers

JOB = registry.find("linkage")


def lengths(rng):
    """Lengths of a crank-rocker whose inequalities hold by some per cent, m."""
    while True:
        l1, l2, l3, l4 = rng.uniform([0.01, 0.05, 0.05, 0.05], [0.08, 0.3, 0.3, 0.3])
        margins = (l2 + l3 - l1 - l4, l3 + l4 - l1 - l2, l2 + l4 - l1 - l3, min(l2, l3, l4) - l1)
        if min(margins) > 0.03 * (l2 + l3):
            return l1, l2, l3, l4


def metres(**values):
    return {name: f"{float(value)!r} m" for name, value in values.items()}


def random_scene(seed):
    """Scene of a crank-rocker that stands anyhow in the plane, with its extremes as events.

    Of every third the crank angle counts from the frame, as in problems/beatup.toml, and no event has `near`.
    """
    rng = np.random.default_rng(seed)
    l1, l2, l3, l4 = lengths(rng)
    turned, start = rng.uniform(-math.pi, math.pi, 2).tolist()
    ax, ay = rng.uniform(-0.2, 0.2, 2).tolist()
    side = ("left", "right")[rng.integers(2)]
    joins, links = ["B", "D"], [("rod", "l2"), ("rocker", "l3")]
    order = -1 if rng.integers(2) else 1
    events = {"front": {"extreme": "max"}, "rear": {"extreme": "min"}}
    if seed % 3:
        first = {"kind": "pivot", **metres(x=ax, y=ay)}
        second = {"kind": "pivot", **metres(x=ax + l4 * math.cos(turned), y=ay + l4 * math.sin(turned))}
        parts = {"A": first, "D": second, "crank": {"start": f"{start!r} rad"}}
    else:
        turned = math.pi * int(rng.integers(2))
        parts = {"D": metres(x=l4 * math.cos(turned))}
    document = changed(FOUR_BAR, dict.fromkeys(("events", "mechanism", "bounds", "limits", "targets")))
    sense = ("clockwise", "counter-clockwise")[rng.integers(2)]
    zero = turned + math.pi - order * (math.pi / 2 if side == "left" else -math.pi / 2)  # across the frame
    output = {"sense": sense, "zero": f"{zero!r} rad"}
    parts["beat"] = {"side": side, "joins": joins[::order], "links": None}
    document = changed(document, {"parts": parts, "output": output, "events": events})
    document["parts"]["beat"]["links"] = dict(links[::order])
    scene = registry.scene({**document, "mechanism": metres(l1=l1, l2=l2, l3=l3)})
    if seed % 3 == 0:
        return scene
    known = JOB.sampler(scene, {}).given.values
    near = {name: known[event_value(name)] + rng.uniform(-0.3, 0.3) for name in events}
    return scene.update({f"events.{name}.near": f"{math.degrees(angle)!r} deg" for name, angle in near.items()})


def numeric(linkage):
    """The same linkage without its closed form."""
    other = Linkage(linkage.chain, linkage.output, linkage.places)
    other.__dict__.update(rocker=None, closed={}, swings=None)
    return other


@pytest.mark.few(20, slow=300)
@pytest.mark.parametrize("seed", range(300))
def test_events_are_those_of_the_scan(seed):
    scene = random_scene(seed)
    linkage = linkage_of(JOB.model(scene))
    assert linkage.closed.keys() == {"front", "rear"}
    values = dict(JOB.sampler(scene, {}).values)
    given, other = Given(values, {}), numeric(linkage)
    assert not linkage.hints(given, ())
    hints = other.hints(given, ())
    assert len(hints) == 3  # both events, and how many turns lie between them
    closed = linkage.derived(FLOAT, given, ())
    scanned = other.derived(FLOAT, Given(values | hints, {}), ())
    for event in linkage.closed:
        name = event_value(event)
        assert closed[name] == pytest.approx(scanned[name], abs=1e-12), event


@pytest.mark.parametrize("seed", range(8))
def test_the_output_stands_still_there_in_40_digits(seed):
    scene = random_scene(seed)
    linkage = linkage_of(JOB.model(scene))
    system = systems.mpmath()
    values = {name: system.number(value) for name, value in JOB.sampler(scene, {}).values.items()}
    given = Given(values, {})
    angles = linkage.derived(system, given, ())
    assert len(angles) == 2
    for angle in angles.values():
        assert abs(linkage.at(system, given, angle).q1) < 1e-35


@pytest.mark.parametrize("seed", range(0, 24, 5))
def test_swing_and_sweep_are_those_between_the_events(seed):
    scene = random_scene(seed)
    sampler = JOB.sampler(scene, {})
    linkage = linkage_of(sampler.model)
    front, rear = (float(sampler.given.values[event_value(event)]) for event in ("front", "rear"))
    there, here = (linkage.at(FLOAT, sampler.given, phi) for phi in (rear, front))
    assert sampler.static["swing"] == pytest.approx(here.since(there), rel=1e-12)
    assert sampler.static["sweep"] == pytest.approx((rear - front) % (2 * math.pi), rel=1e-12)


def test_a_group_needs_fixed_pivots_and_a_crank_on_the_main_shaft():
    assert set(crank_rockers(linkage_of(JOB.model(four_bar())).chain)) == {"rocker"}
    assert set(crank_rockers(linkage_of(JOB.model(registry.load("sixbar-sley"))).chain)) == {"rocker"}
    geared = four_bar(parts={"crank": {"ratio": 2}}, events={"front": {"near": "33 deg"}, "rear": {"near": "122 deg"}})
    assert not crank_rockers(linkage_of(JOB.model(geared)).chain)


def test_a_drag_link_keeps_its_message():
    drag = {"l1": "90 mm", "l2": "80 mm", "l3": "85 mm", "l4": "40 mm"}
    with pytest.raises(BadInput, match="never turns back"):
        JOB.check(four_bar(mechanism=drag, bounds=None, limits=None, targets=None))
