"""Stretches over which a quantity is as good as zero."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.sampling import near_zero


def sampler(name, **design):
    job, scene = registry.of(lo.load(name)), lo.load(name)
    return job.sampler(scene, {**job.today(scene), **design})


def test_stretches_are_those_of_the_curve():
    """Where the cam force of the packaged frame is at most 50 N, by its curve and by its stretches."""
    values, close = sampler("shedding"), 0.001
    frame = lo.simulate("shedding")
    low = frame["phi [rad]"][np.abs(frame["N [N]"]) <= 50.0]
    result = near_zero(values, "lift", 50.0, 0.0)
    inside = [any(begin - close <= phi <= end + close for begin, end in result) for phi in low]
    assert len(result) >= 2
    assert all(inside)
    assert near_zero(values, "lift", 0.0, 0.0) == []


def test_a_stretch_across_the_turns_end_is_one():
    """The cam force of the near dwell, which ends at 0 deg, lasts into the rise."""
    turning = sampler("shedding")
    least = abs(float(lo.simulate("shedding")["N [N]"].iloc[0]))
    crossing = [(begin, end) for begin, end in near_zero(turning, "lift", 10 * least, 0.0) if end > 2 * math.pi]
    ((begin, end),) = crossing
    assert begin < math.radians(300)
    assert end < math.radians(370)
    ((begin, end),) = near_zero(turning, "lift", 1e9, 0.0)
    assert (begin, end) == pytest.approx((0.0, 2 * math.pi)), "the whole turn"


def test_it_counts_where_the_quantity_is_known_and_from_a_width_on():
    static = sampler("shedding-static")
    spans = near_zero(static, "lift", 1e9, 0.0)
    assert sum(end - begin for begin, end in spans) == pytest.approx(math.radians(120), abs=math.radians(0.2))
    assert near_zero(static, "lift", 1e9, math.radians(61)) == [], "known in two dwells of 60 deg only"
