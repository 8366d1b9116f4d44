"""Proven worst cases of linkages whose corners follow from events: boxes of tolerances over followed events."""

import itertools

import numpy as np
import pytest
from support.linkage_scenes import four_bar
from support.random_tolerances import scenes

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths.intervals import Interval
from loomopt.model.sampling import Sampler
from loomopt.solving.proof.task import OpenError
from loomopt.solving.proof.tolerance_box import NumberBox

TOLERANCES = dict.fromkeys(("l1", "l2", "l3", "l4"), "0.05 mm")


def box(scene, half):
    """Return the box of a linkage's lengths within half, m, and the values of its middle."""
    job = registry.of(scene)
    sampler = job.sampler(scene, {})
    names = [name for name, kind in scene.schema.variables.items() if kind == "length"]
    ends = {name: (sampler.values[name] - half, sampler.values[name] + half) for name in names}
    return NumberBox(sampler.model, sampler.values, ends), sampler, ends


@pytest.mark.parametrize(
    "events",
    [
        {"front": {"near": None}},
        {"front": {"near": "66 deg"}},
        {"touch": {"travel": "5 deg", "before": "front"}},
        {"touch": {"travel": "9 deg", "after": "front"}},
    ],
    ids=str,
)
def test_events_of_every_machine_lie_in_the_box(events):
    found, sampler, ends = box(four_bar(events=events), 2e-4)
    given = found.given(found.low[:, None], found.high[:, None])
    draw = np.random.default_rng(3)
    corners = itertools.product(*ends.values())
    inside = (draw.uniform(found.low, found.high) for _ in range(16))
    for lengths in (*corners, *inside):
        machine = Sampler(sampler.model, {**sampler.values, **dict(zip(ends, map(float, lengths), strict=True))})
        for place in sampler.model.kinematics.places:
            enclosed = given.values[place.value].v
            angle = machine.given.values[place.value]
            assert enclosed.low.item() - 1e-13 <= angle <= enclosed.high.item() + 1e-13
            assert enclosed.high.item() - enclosed.low.item() < 0.2


def test_slopes_of_events_hold_those_of_differences():
    found, sampler, ends = box(four_bar(), 1e-5)
    enclosed = found.given(found.low[:, None], found.high[:, None]).values["event front"].g
    for k, name in enumerate(ends):
        step = 1e-6
        one, other = (
            Sampler(sampler.model, {**sampler.values, name: sampler.values[name] + side * step}) for side in (1, -1)
        )
        slope = (one.given.values["event front"] - other.given.values["event front"]) / (2 * step)
        own = Interval(enclosed.low[k].item(), enclosed.high[k].item())
        assert own.low - 1e-6 * abs(slope) <= slope <= own.high + 1e-6 * abs(slope)


def test_a_box_in_which_an_event_may_be_another_is_left_open():
    with pytest.raises(OpenError, match="a turn of the output is not enclosed"):
        box(four_bar(), 8e-3)


@pytest.mark.slow
def test_a_four_bar_with_a_pulse_about_its_front_is_decided():
    found = lo.tolerance(four_bar(tolerances=TOLERANCES), samples=16, worst=True).as_dict()["worst"]
    assert {"swing", "sweep", "moment.front", "peak_torque"} <= set(found)
    for name, worst in found.items():
        assert worst["proven"], (name, worst["why"])
        assert worst["min"] <= worst["found"][0] <= worst["found"][1] <= worst["max"]


@pytest.mark.slow
@pytest.mark.parametrize(("count", "fewest"), [(6, 5), pytest.param(60, 50, marks=pytest.mark.whole)])
def test_of_random_linkages_five_in_six_are_decided(count, fewest):
    decided = 0
    for scene in scenes(count):
        worst = lo.tolerance(scene, samples=16, worst=True).as_dict()["worst"]
        decided += all(each["proven"] for each in worst.values())
        for each in worst.values():
            assert not each["proven"] or each["min"] <= each["found"][0] <= each["found"][1] <= each["max"]
    assert decided >= fewest
