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
    """Box of a linkage's lengths within ±half, m, the sampler of its middle, and the ends of the box."""
    job = registry.of(scene)
    sampler = job.sampler(scene, {})
    names = [name for name, kind in scene.schema.variables.items() if kind == "length"]
    ends = {name: (sampler.values[name] - half, sampler.values[name] + half) for name in names}
    return NumberBox(sampler.model, sampler.values, ends), sampler, ends


@pytest.mark.few(2)
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
    lengths_box, sampler, ends = box(four_bar(events=events), 2e-4)
    given = lengths_box.given(lengths_box.low[:, None], lengths_box.high[:, None])
    draw = np.random.default_rng(3)
    corners = itertools.product(*ends.values())
    inside = (draw.uniform(lengths_box.low, lengths_box.high) for _ in range(16))
    for lengths in (*corners, *inside):
        machine = Sampler(sampler.model, {**sampler.values, **dict(zip(ends, map(float, lengths), strict=True))})
        for place in sampler.model.kinematics.places:
            enclosed = given.values[place.value].v
            angle = machine.given.values[place.value]
            assert enclosed.low.item() - 1e-13 <= angle <= enclosed.high.item() + 1e-13
            assert enclosed.high.item() - enclosed.low.item() < 0.2


def test_slopes_of_events_enclose_differences():
    lengths_box, sampler, ends = box(four_bar(), 1e-5)
    enclosed = lengths_box.given(lengths_box.low[:, None], lengths_box.high[:, None]).values["event front"].g
    for k, name in enumerate(ends):
        step = 1e-6
        above, below = (
            Sampler(sampler.model, {**sampler.values, name: sampler.values[name] + side * step}) for side in (1, -1)
        )
        slope = (above.given.values["event front"] - below.given.values["event front"]) / (2 * step)
        interval = Interval(enclosed.low[k].item(), enclosed.high[k].item())
        assert interval.low - 1e-6 * abs(slope) <= slope <= interval.high + 1e-6 * abs(slope)


def test_a_box_in_which_an_event_is_not_unique_is_undecided():
    with pytest.raises(OpenError, match="a turn of the output is not enclosed"):
        box(four_bar(events={"touch": {"travel": "5 deg", "before": "front"}}), 8e-3)


@pytest.mark.slow
def test_a_four_bar_with_a_pulse_about_its_front_is_decided():
    cases = lo.tolerance(four_bar(tolerances=TOLERANCES), samples=16, worst=True).as_dict()["worst"]
    assert {"swing", "sweep", "moment.front", "peak_torque"} <= set(cases)
    for name, worst in cases.items():
        assert worst["proven"], (name, worst["why"])
        assert worst["min"] <= worst["found"][0] <= worst["found"][1] <= worst["max"]


@pytest.mark.slow
@pytest.mark.parametrize(("count", "fewest"), [(6, 5), pytest.param(60, 50, marks=pytest.mark.whole)])
def test_of_random_linkages_five_in_six_are_decided(count, fewest):
    decided = 0
    for scene in scenes(count):
        worst = lo.tolerance(scene, samples=16, worst=True).as_dict()["worst"]
        decided += all(case["proven"] for case in worst.values())
        for case in worst.values():
            assert not case["proven"] or case["min"] <= case["found"][0] <= case["found"][1] <= case["max"]
    assert decided >= fewest
