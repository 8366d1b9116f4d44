"""The common scale of lengths: left out where 40 digits say that nothing reads it, and put back inside the bounds."""

import pytest
from machines_in_boxes import designs, solved

from loomopt.solving.proof.task import silent

FREE = [
    ("beatup", "balance"),
    ("beatup", "torque"),
    ("beatup", "balance", "bearing_friction"),
    ("beatup", "balance", "gravity"),
]
READ = [("beatup", "balance", "rod_inertia"), ("beatup", "retrofit")]


@pytest.mark.parametrize("given", FREE)
def test_a_scale_that_nothing_reads_is_left_out(given):
    result = silent(solved(*given).program)
    assert result is not None
    assert set(result.bounds) == {"l1", "l2", "l3", "l4"}
    assert result.fixed_length == {"l4": 0.167}


@pytest.mark.parametrize("given", READ)
def test_a_scale_that_an_effect_or_a_target_reads_is_not(given):
    assert silent(solved(*given).program) is None


@pytest.mark.slow
def test_every_design_has_a_place_without_its_scale_and_a_design_at_that_place():
    program = solved("beatup", "balance").program
    result = silent(program)
    assert result is not None
    for x, _ in designs(program, 40):
        at = result.taken_out(x)
        assert at["l4"] == pytest.approx(0.167, rel=1e-15)
        for name, (low, high) in result.ends.items():
            assert low * (1 - 1e-15) <= at[name] <= high * (1 + 1e-15)
        for a, b, share in result.pairs:
            assert at[a] <= at[b] * share * (1 + 1e-15)
        back = result.inside(at)
        for v in program.variables:
            assert v.lower - 1e-15 <= back[v.name] <= v.upper + 1e-15
        assert back["l1"] / back["l4"] == pytest.approx(x["l1"] / x["l4"], rel=1e-14)
