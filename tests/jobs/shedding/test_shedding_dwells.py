"""Contact that is judged in the dwells only: each that is there, none that is not, and never the moves."""

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.solving.certificate import kkt

G, T1, T2, H, X0 = 369.55, 124.545, 83.03, 0.0656, 0.08
STATIC = lo.load("shedding-static")


def least(dwells, n_min):
    """K1, N/m, by statics: K1 (X0 + X) = N_min + G + T in each dwell that is there."""
    results = {"far_dwell": (n_min + G - T2) / (X0 + H), "near_dwell": (n_min + G + T1) / X0}
    return max(results[name] for name in dwells)


@pytest.mark.parametrize("n_min", [0.0, 5.0])
@pytest.mark.parametrize("length", ["0", "1e-12", "5e-11", "3e-10", "1e-8", "1e-3"])
@pytest.mark.parametrize("gone", ["near_dwell", "far_dwell"])
@pytest.mark.few(4)
def test_a_dwell_counts_from_the_least_length_that_floats_tell_from_none(gone, length, n_min):
    remaining = "far_dwell" if gone == "near_dwell" else "near_dwell"
    turned = {f"mechanism.{gone}": f"{length} deg", "mechanism.return": f"{180 - float(length)!r} deg"}
    scene = STATIC.update({**turned, "operation.N_min": f"{n_min} N"})
    there = (remaining, gone) if float(length) > 5.8e-11 else (remaining,)
    answer = lo.solve(scene, prove=True)
    assert answer.status == "optimal", answer.message
    assert answer.figures["K1"] == pytest.approx(least(there, n_min), rel=1e-12)
    assert answer.figures["contact_min"] == pytest.approx(n_min, abs=1e-9)
    words = "in both dwells" if len(there) > 1 else f"in the {remaining.removesuffix('_dwell')} dwell"
    assert words in answer.message


def test_a_travel_that_would_better_be_longer_has_a_price_of_that_side():
    """Without a near dwell, more travel stretches the spring: what is kept binds on its other side."""
    scene = STATIC.update({"mechanism.near_dwell": "0 deg", "mechanism.return": "180 deg"})
    answer = lo.solve(scene)
    (price,) = [item for item in answer.binding if item.limit == "travel"]
    longer = lo.solve(scene.set("mechanism.travel", "65.601 mm")).figures["K1"]
    assert price.text == "travel <= 65.6 mm"
    assert price.side == "max"
    assert price.worth["K1"] == pytest.approx((answer.figures["K1"] - longer) / 1e-6, rel=1e-4)


def test_variables_without_room_are_held_on_both_sides():
    from loomopt.model.limits import BoundLimit
    from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet

    limit = BoundLimit("kept", -1, "a", 1.0, 1.0)
    rows = (ActiveRow("kept", "a", 1.0, 1.0, 0, 0.0, limit), ActiveRow("f", "f", 1.0, 1.0, 0, 0.0))
    active = ActiveSet(rows, 1, ((1,),), (False,), (0.0,))
    assert kkt.system(active, 0, []).inequalities == (0,)
    assert kkt.system(active, 0, [], frozenset({"a"})).equalities == (0,)


def test_a_cam_without_the_dwells_in_which_a_load_is_known_is_refused():
    turned = {"rise": "180 deg", "far_dwell": "0 deg", "return": "180 deg", "near_dwell": "0 deg"}
    with pytest.raises(BadInput, match="warp_tension is known in the dwells only, and there are none"):
        STATIC.update({f"mechanism.{name}": value for name, value in turned.items()})


@pytest.mark.few(1)
@pytest.mark.parametrize("effects", [(), ("inertia",), ("inertia", "damping")])
def test_the_least_peak_force_is_that_of_the_dwells(effects):
    """In the far dwell N = K1 (X0 + h) − G + T2, K1 the least that holds in the near one: no speed comes into it."""
    scene = STATIC
    for name in effects:
        scene = scene.with_effect(name)
    answer = lo.solve(scene, target="force", prove=True)
    peak = least(("near_dwell",), 0.0) * (X0 + H) - G + T2
    assert answer.status == "optimal", answer.message
    assert answer.figures["contact_max"] == pytest.approx(peak, rel=1e-12)
    assert "The least peak cam force in both dwells is 612.733 N" in answer.message
    assert "The moves, where not every force is known, are not judged." in answer.message


def test_a_limit_on_the_peak_force_holds_in_the_dwells_alone():
    """With inertia the moves, were the pull of the warp 0 in them, would take thousands of newtons."""
    scene = STATIC.with_effect("inertia").set("limits.contact_max.max", "700 N")
    answer = lo.solve(scene)
    assert answer.status == "optimal", answer.message
    assert answer.figures["contact_max"] == pytest.approx(612.7329, rel=1e-9)
    assert all(limit.ok for limit in answer.limits)


@pytest.mark.slow
def test_a_free_law_is_chosen_by_contact_in_the_dwells_alone():
    """No law changes the dwells: the least spring is that of statics, whatever the law."""
    answer = lo.solve(STATIC.with_effect("inertia"), target="law")
    assert answer.status == "optimal", answer.message
    assert answer.figures["K1"] == pytest.approx(6176.1875, rel=1e-9)
