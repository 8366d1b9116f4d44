"""Four lengths that are no crank-rocker: which inequality fails, and where the crank stops."""

import math
import re
from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from loomopt.physics.mechanisms.crank_rocker import Lengths, assembly_margins, fault

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=100)
lengths = st.floats(0.02, 1.0)
BEYOND = re.compile(r"beyond crank angle (\S+) deg")
WITHIN = re.compile(r"within (\S+) deg of crank angle 0")


def closes(l1, l2, l3, l4, degrees):
    """Say whether a triangle of rod, rocker and the distance between their far ends exists."""
    angle = math.radians(degrees)
    distance = math.hypot(l4 - l1 * math.cos(angle), l1 * math.sin(angle))
    return abs(l2 - l3) < distance < l2 + l3


def shown(match):
    """Return an angle of a message, deg, and half its sixth digit."""
    angle = float(match.group(1))
    return angle, 0.51 * 10.0 ** (math.floor(math.log10(angle)) - 5) if angle else 0.0


@given(lengths, lengths, lengths, lengths)
@REPEATABLE
def test_the_message_names_the_crank_angles_where_the_dyad_opens(l1, l2, l3, l4):
    assume(min(abs(l1 + l4 - l2 - l3), abs(abs(l4 - l1) - abs(l2 - l3)), abs(l1 - l4)) > 1e-9)
    message = fault(l1, l2, l3, l4)
    all_round = [closes(l1, l2, l3, l4, degrees / 4) for degrees in range(721)]
    beyond, within = BEYOND.search(message), WITHIN.search(message)
    if "at no crank angle" in message:
        assert not any(all_round)
    elif beyond or within:
        upper, last = shown(beyond) if beyond else (180.0, 0.0)
        lower, first = shown(within) if within else (0.0, 0.0)
        assume(upper - lower > 2 * (first + last))
        assert closes(l1, l2, l3, l4, lower + first + 1e-9)
        assert closes(l1, l2, l3, l4, upper - last - 1e-9)
        assert lower - first <= 0 or not closes(l1, l2, l3, l4, lower - first)
        assert upper + last >= 180 or not closes(l1, l2, l3, l4, upper + last)
    else:
        assert all(all_round[1:-1])
        assert bool(message) == (l1 >= min(l2, l3, l4)), "it closes all round: only a longer crank is at fault"


@given(lengths, lengths, lengths, lengths)
@REPEATABLE
def test_the_message_names_an_inequality_that_fails_and_only_then(l1, l2, l3, l4):
    sides = {"l1": Fraction(l1), "l2": Fraction(l2), "l3": Fraction(l3), "l4": Fraction(l4)}
    shortest, longest = min(sides.values()), max(sides.values())
    slack = sum(sides.values()) - 2 * (shortest + longest)
    assume(abs(slack) > 1e-14)
    assume(len(set(sides.values())) == 4)
    message = fault(l1, l2, l3, l4)
    is_one = slack > 0 and shortest == l1
    assert (message == "") == is_one
    if message:
        named = re.match(r"(l\d(?: \+ l\d)?) < (l\d(?: \+ l\d)?) fails \((\S+) mm against (\S+) mm\); ", message)
        left, right = (sum(sides[name] for name in named.group(k).split(" + ")) for k in (1, 2))
        assert left >= right
        assert (float(named.group(3)), float(named.group(4))) == pytest.approx(
            (float(left) * 1e3, float(right) * 1e3), rel=1e-5
        )


@pytest.mark.parametrize(
    ("mm", "message"),
    [
        ((31, 65, 155, 167), ""),
        (
            (31, 30, 155, 167),
            "l1 + l4 < l2 + l3 fails (198 mm against 185 mm); it does not assemble beyond crank angle 121.273 deg",
        ),
        (
            (31, 200, 40, 167),
            "l1 + l2 < l3 + l4 fails (231 mm against 207 mm); it does not assemble within 71.7063 deg of crank angle 0",
        ),
        (
            (31, 40, 200, 167),
            "l1 + l3 < l2 + l4 fails (231 mm against 207 mm); it does not assemble within 71.7063 deg of crank angle 0",
        ),
        ((31, 20, 400, 167), "it assembles at no crank angle"),
        ((31, 20, 60, 167), "it assembles at no crank angle"),
        ((100, 90, 95, 30), "the rocker turns through: the crank is not the shortest link"),
    ],
)
def test_messages(mm, message):
    result = fault(*(length / 1e3 for length in mm))
    assert result == message if not message else message in result


@pytest.mark.parametrize(
    ("sides", "end"),
    [
        ((1.0, 2.0, 3.0, 4.0), "beyond crank angle 180 deg"),
        ((1.0, 4.0, 2.0, 3.0), "within 0 deg of crank angle 0"),
        ((1.0, 2.0, 4.0, 3.0), "within 0 deg of crank angle 0"),
        ((2.0, 2.0, 2.0, 2.0), "beyond crank angle 180 deg and within 0 deg of crank angle 0"),
    ],
)
def test_a_linkage_that_folds_flat_is_no_crank_rocker(sides, end):
    message = fault(*sides)
    assert " fails (" in message
    assert message.endswith(f"it does not assemble {end}")


@given(lengths, lengths, lengths, lengths)
@REPEATABLE
def test_each_margin_is_the_difference_of_the_links_it_is_filed_under(l1, l2, l3, l4):
    sides = Lengths(l1, l2, l3, l4)
    for (shorter, longer), margin in assembly_margins(sides).items():
        ends = (math.fsum(getattr(sides, name) for name in names) for names in (longer, shorter))
        assert margin == pytest.approx(next(ends) - next(ends), abs=1e-15)
