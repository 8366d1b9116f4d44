"""Target dwell: the largest that the stroke allows; and the table of dwell against acceleration from one built NLP."""

import itertools
import math

import pytest

import loomopt as lo
from reference.rapier import Drive

TABLE = range(25, 46, 2)


def dwelling(scene, angle):
    """Return the scene with both dwells required, rad."""
    return scene.update({f"operation.{name}": f"{angle!r} rad" for name in ("dwell_after", "dwell_before")})


@pytest.fixture(scope="module")
def scene():
    return lo.load("rapier")


@pytest.fixture(scope="module")
def longest(scene):
    return lo.solve(scene, "dwell", starts=1)


def test_longest_dwell_is_held_on_both_sides_at_the_exact_stroke(scene, longest):
    drive, dwell = Drive(scene, longest.design), longest.figures["dwell"]
    assert longest.status == "optimal"
    assert drive.stroke() == pytest.approx(0.850, rel=1e-9)
    assert drive.stray(dwell, dwell) <= 6e-3 * (1 + 1e-9)
    assert drive.dwells() == pytest.approx((dwell, dwell), rel=1e-9)
    assert drive.mu_min() >= math.radians(30) - 1e-9


@pytest.mark.slow
def test_longest_dwell_lies_between_what_exists_and_what_does_not(scene, longest):
    near = math.radians(0.2)
    shorter, longer = (
        lo.solve(dwelling(scene, longest.figures["dwell"] + change), starts=1) for change in (-near, near)
    )
    assert shorter.status == "optimal"
    assert Drive(scene, shorter.design).stray(*[longest.figures["dwell"] - near] * 2) <= 6e-3 * (1 + 1e-9)
    assert longer.status == "infeasible"
    assert longer.relaxation
    assert longer.figures["peak_acceleration"] is not None


@pytest.mark.parametrize("name", ["stroke", "s_dwell", "mu_min"])
def test_what_loosening_is_worth_to_the_dwell_is_confirmed_by_solving_again(scene, longest, name):
    (price,) = [price for price in longest.binding if price.limit == name]
    step, unit = {"stroke": (1e-4, "m"), "s_dwell": (2e-5, "m"), "mu_min": (2e-3, "rad")}[name]
    key = "limits.mu_min.min" if name == "mu_min" else f"operation.{name}"
    outward = step if price.side == "max" else -step
    values = [price.value + k * outward for k in (-1, 1)]
    tight, loose = (lo.solve(scene.set(key, f"{value!r} {unit}"), "dwell", warm_start=longest) for value in values)
    assert tight.status == loose.status == "optimal"
    gain = (loose.figures["dwell"] - tight.figures["dwell"]) / (2 * step)
    assert abs(price.worth["dwell"]) == pytest.approx(gain, rel=1e-3)


@pytest.fixture(scope="module")
def table(scene):
    """Return the answers of eleven dwells, each solved near the one before."""
    near, answers = None, []
    for degrees in TABLE:
        near = lo.solve(dwelling(scene, math.radians(degrees)), warm_start=near)
        answers.append(near)
    return answers


@pytest.mark.slow
def test_longer_dwells_cost_acceleration_throughout_the_table(scene, table):
    assert [answer.status for answer in table] == ["optimal"] * len(TABLE)
    peaks = [Drive(scene, answer.design).peak(2) for answer in table]
    assert peaks == sorted(peaks)
    assert all(later > earlier + 1e-3 for earlier, later in itertools.pairwise(peaks))


@pytest.mark.slow
def test_table_of_dwells_is_what_cold_solves_give(scene, table):
    for place in (0, 5, 10):
        cold = lo.solve(dwelling(scene, math.radians(TABLE[place])), starts=1)
        assert cold.figures["peak_acceleration"] == pytest.approx(table[place].figures["peak_acceleration"], rel=1e-8)


@pytest.mark.slow
def test_table_of_dwells_needs_one_built_nlp(table):
    """What is left of building is the task's own numbers; writing down an NLP takes most of a call."""
    assert max(answer.time["build_s"] / answer.time["total_s"] for answer in table[1:]) <= 0.3
