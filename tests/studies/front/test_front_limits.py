"""Limits of the scene on axes: what stands in the way of an end that is sought is lifted and told, the rest is held."""

import pytest

import loomopt as lo
from loomopt.studies.front import front

SWING = {"limits.swing.min": "22.9 deg", "limits.swing.max": "23.4 deg"}


@pytest.mark.parametrize(
    ("limits", "sense", "left", "message"),
    [
        (SWING, "least", (None, 23.4), ("swing at least 22.9 deg",)),
        (SWING, "most", (22.9, None), ("swing at most 23.4 deg",)),
        ({"limits.swing.min": "23 deg", "limits.swing.max": "23 deg"}, "most", None, ("swing 23 deg",)),
    ],
)
def test_a_limit_in_the_way_of_an_end_that_is_sought_is_lifted_and_told(limits, sense, left, message):
    scene = lo.load("beatup").update(limits)
    most = ("swing",) if sense == "most" else ()
    trade = front.trade(
        scene, ("peak_torque", "swing"), maximise=most, minimise=("peak_torque", "swing")[: 2 - len(most)]
    )
    limit = trade.scene.limits.get("swing")
    degrees = limit and tuple(end and end * 57.29577951308232 for end in limit[:2])
    assert degrees == (left and pytest.approx(left))
    assert trade.lifted == message
    assert str(trade.conditions["not held"]).startswith(message[0])


def test_a_limit_on_what_is_not_sought_is_held():
    scene = lo.load("beatup")
    trade = front.trade(scene, ("peak_torque", "m4e"))
    assert trade.scene is scene
    assert trade.lifted == ()


@pytest.mark.slow
def test_a_front_of_a_figure_that_a_scene_holds_at_one_value_goes_beyond_it():
    scene = lo.load("beatup").update({"limits.swing.min": "23 deg", "limits.swing.max": "23 deg"})
    second_front = lo.pareto(scene, ("peak_torque", "swing"), "none", ranges={"swing": "22:23.3 deg"}, points=3)
    places = [row.figures["swing"] * 57.29577951308232 for row in second_front.rows if not row.narrows]
    assert places == pytest.approx([22.0, 22.39844, 22.79688], abs=1e-4)
    assert all(row.certified for row in second_front.rows)
