"""Nodes of boxes: the worst of a middle, and certainty that all of a box has the same order of corners."""

import numpy as np
import pytest
from machines_in_boxes import designs, solved

from loomopt.maths import systems
from loomopt.maths.intervals import Interval
from loomopt.model.sampling import Sampler
from loomopt.solving.proof.reading import layouts


def layout_of(task, at):
    ((layout, _),) = layouts(task, at[:, None], {})
    return layout


@pytest.mark.slow
def test_the_worst_node_of_a_middle_is_close_to_its_true_peak():
    solution = solved("beatup", "balance", "bearing_friction")
    task = solution.task
    for x, _ in designs(solution.program, 20):
        at = task.place(x)
        layout = layout_of(task, at)
        spot = layout.worst(task, "peak_torque", at[:, None])
        sampler = Sampler(solution.program.model, task.values(at))
        corners = solution.program.model.corners(systems.FLOAT, sampler.given)
        angle = 2 * np.pi * spot.turns[0, 0] + sum(
            float(s[0, 0]) * c for s, c in zip(spot.shares, corners, strict=True)
        )
        switch = {name: float(column[0, 0]) for name, column in spot.switches.items()}
        height = spot.sign[0, 0] * sampler.rows.quantity("peak_torque", float(angle), switch)
        peak = sampler.peak("peak_torque")
        assert 0.97 * peak <= height <= peak * (1 + 1e-12)


def test_middles_are_parted_by_the_order_of_their_corners():
    """Seen from the first corner, the friction's, the pulse's end passes the rear dead centre for a long pulse."""
    task = solved("beatup", "balance", "bearing_friction", "effects.resistance.pulse=340 deg").task
    rng = np.random.default_rng(1)
    middles = task.low[:, None] + rng.random((len(task.low), 60)) * task.sizes[:, None]
    parted = list(layouts(task, middles, {}))
    assert sorted(int(k) for _, places in parted for k in places) == list(range(60))
    for layout, places in parted:
        for k in places if layout else ():
            cycle = Sampler(task.program.model, task.values(middles[:, k])).cycle
            assert cycle.order == layout.cycle.order


def test_an_order_is_certain_only_where_no_corner_can_pass_another():
    solution = solved("beatup", "balance")
    task, model = solution.task, solution.program.model
    at = task.place(solution.x)
    layout = layout_of(task, at)
    half = np.array([0.0, 1e-3, 3e-2])[None] * np.ones((4, 1)) * np.array([1.0, 1.0, 1.0, 0.0])[:, None]
    given = model.given(systems.boxes(), task.numbers(at[:, None] - half, at[:, None] + half))
    events = {name: model.event(systems.boxes(), given, name) for name in model.events_read}
    assert layout.certain(model.corners(systems.boxes(), given), events, 3).tolist() == [True, True, False]


def test_an_event_that_is_a_corner_is_where_it_always_is():
    solution = solved("beatup", "balance", "bearing_friction")
    task, model = solution.task, solution.program.model
    at = task.place(solution.x)
    layout = layout_of(task, at)
    given = model.given(systems.boxes(), task.numbers(at[:, None] - 1e-4, at[:, None] + 1e-4))
    corners = model.corners(systems.boxes(), given)
    events = {name: model.event(systems.boxes(), given, name) for name in model.events_read}
    assert layout.certain(corners, events, 1).all()
    # The same angle as a number of its own could lie on either side of the corner.
    other = {name: Interval(angle.v.low, angle.v.high) for name, angle in events.items()}
    assert not layout.certain(corners, other, 1).any()
