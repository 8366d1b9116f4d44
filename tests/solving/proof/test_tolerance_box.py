"""Claims over boxes of numbers and crank angles: what is proven holds on every machine, what is false is not proven."""

import functools

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.model.machines import Machines
from loomopt.model.sampling import sampled
from loomopt.solving.proof import tolerance_box
from loomopt.solving.proof.task import OpenError
from loomopt.solving.proof.tolerance_box import NumberBox, Peak, Single

CASES = [
    ("beatup", "peak_torque", ("l1", "l4", "M0"), 2e-3),
    ("beatup", "obliquity", ("l1", "l2", "l3", "l4"), 1e-2),
    ("rapier", "peak_acceleration", ("l4", "C0x", "phi40"), 2e-4),
    ("shedding", "lift", ("K1", "X0", "travel", "speed"), 1e-2),
]


def box_of(problem, names, share, count=400):
    scene = registry.load(problem)
    job = registry.of(scene)
    known = job.numbers(scene)
    ends = {name: (known[name] * (1 - share), known[name] * (1 + share)) for name in names}
    generator = np.random.default_rng(5)
    shares = generator.uniform(0.0, 1.0, (len(names), count))
    shares[:, : count // 2] = np.round(shares[:, : count // 2])
    drawn = {n: low * (1 - s) + high * s for (n, (low, high)), s in zip(ends.items(), shares, strict=True)}
    model = job.model(scene)
    return NumberBox(model, known, ends), Machines(model, {**known, **drawn}, sampled(model, known))


def times(row, sign, rows):
    return rows.single(row) * sign


def below(box, quantity, bound, work=tolerance_box.MOST_PARTS):
    signs = (1.0,) if quantity in box.model.signed else (1.0, -1.0)
    pieces = [piece for sign in signs for piece in tolerance_box.over_cycle(box, quantity, sign)]
    return tolerance_box.all_at_most(pieces, bound, work)


@pytest.mark.few(1)
@pytest.mark.parametrize(("problem", "quantity", "names", "share"), CASES)
def test_a_peak_is_bounded_by_the_farthest_corner_and_by_nothing_less(problem, quantity, names, share):
    box, machines = box_of(problem, names, share)
    peaks = machines.peak(quantity)
    width = np.ptp(peaks)
    assert below(box, quantity, peaks.max() + 0.01 * width).proven
    for less in (1e-3, 0.3):
        assert not below(box, quantity, peaks.max() - less * width).proven, less


def test_a_peak_is_nowhere_less_than_the_least():
    box, machines = box_of("beatup", ("l1", "l2", "l3", "l4"), 1e-3)
    peaks = machines.peak("peak_torque")
    width, tops = np.ptp(peaks), box.sampler.extremes("peak_torque")
    nodes = [(item.piece, item.u, item.sign) for item in sorted(tops, key=lambda item: -item.height)[:4]]
    least = Peak(box, "peak_torque", nodes)
    assert tolerance_box.at_most(least, -(peaks.min() - 0.02 * width)).proven
    assert not tolerance_box.at_most(least, -(peaks.min() + 1e-6 * width), 600).proven


def test_a_value_of_the_design_alone():
    box, machines = box_of("beatup", ("l1", "l2", "l3", "l4"), 3e-3)
    for row in ("swing", "theta", "mu_near", "M3_fdc"):
        values = machines.single(row)
        width = np.ptp(values)
        for sign, far in ((1.0, values.max()), (-1.0, -values.min())):
            read = Single(box, functools.partial(times, row, sign))
            assert tolerance_box.at_most(read, far + 0.02 * width).proven, row
            assert not tolerance_box.at_most(read, far - 1e-6 * width, 600).proven, row


@pytest.mark.slow
def test_what_stands_alone_in_its_box_is_read_like_the_machine():
    scene = registry.load("beatup")
    job = registry.of(scene)
    known = job.numbers(scene)
    box = NumberBox(job.model(scene), known, {"l1": (known["l1"], known["l1"])})
    peak = box.sampler.peak("peak_torque")
    assert below(box, "peak_torque", peak * (1 + 1e-9)).proven
    assert not below(box, "peak_torque", peak * (1 - 1e-7)).proven


def test_corners_that_may_change_places_leave_a_box_open():
    """The pulse's end passes rear dead centre, where the bearings' friction turns round, within the box."""
    scene = registry.load("beatup").with_effect("bearing_friction")
    job = registry.of(scene)
    known = job.numbers(scene)
    name = next(key for key in known if key.endswith("pulse"))
    with pytest.raises(OpenError, match="change places"):
        NumberBox(job.model(scene), known, {name: (0.5, 6.25)})
    twisting = registry.load("beatup").with_effect("shaft_torsion")
    model, known = job.model(twisting), job.numbers(twisting)
    with pytest.raises(OpenError, match="shaft_torsion"):
        NumberBox(model, known, {"l1": (0.03, 0.031)})
