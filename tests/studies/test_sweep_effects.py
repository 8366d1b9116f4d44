"""Sweeps with every effect on, one by one and together: every row agrees with a separate solve."""

import math

import pytest
from support.effect_choices import CASES, MACHINES, choices, machine

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.studies import sweep

QUICK = [("shedding", "joint_forces"), ("linkage", "mass.rod")]


def rows_that_differ(scene, over, target=None):
    """Differences of every row of a sweep from a separate solve, by point, without equal rows."""
    result = lo.sweep(scene, over, target=target)
    assert len(result.rows) == result.study.size
    return {row.point: texts for row in result.rows if (texts := differences(row, result.study))}


def differences(row, plan):
    """Differences of a row from a separate solve."""
    answer = lo.solve(plan.scene_at(row.point), plan.target)
    if row.status != answer.status:
        return [f"{row.status} ({row.reason}), and not {answer.status} ({answer.message})"]
    texts = []
    passed = answer.certificate is not None and answer.certificate.passed
    if row.certified != passed:
        texts.append(f"certified: {row.certified}, and not {passed}")
    if (binds := set(row.multipliers)) != (active := set(sweep.multipliers(answer.result))):
        texts.append(f"what binds: {binds ^ active}")
    if row.figures.keys() != answer.figures.keys():
        return [*texts, f"figures: {row.figures.keys() ^ answer.figures.keys()}"]
    for name, value in answer.figures.items():
        if not agree(row.figures[name], value, 1e-6 if name in plan.shown else 1e-5):
            texts.append(f"{name}: {row.figures[name]}, and not {value}")
    return texts


def agree(value, reference, share):
    """Whether two figures agree; share: the accuracy of a solve for objectives, its root for other figures."""
    if value is None or reference is None or not math.isfinite(reference):
        return (value is None) == (reference is None or not math.isfinite(reference))
    return abs(value - reference) <= share * max(1.0, abs(reference))


@pytest.mark.slow
def test_torques_with_joint_forces_on_are_those_without_them():
    """A figure reads mass and radius of the counterweight, while the solve uses only their product."""
    over = {"operation.M0": "720:760:10 N*m"}
    scene = lo.load("beatup")
    bare, forced = lo.sweep(scene, over), lo.sweep(scene.with_effect("joint_forces"), over)
    assert [row.status for row in forced.rows] == ["optimal"] * 5
    for row, reference in zip(forced.rows, bare.rows, strict=True):
        assert row.parent == reference.parent
        assert all(row.figures[name] == value for name, value in reference.figures.items() if value is not None)
        assert row.figures["force_A"] > 0.0


@pytest.mark.few(1)
@pytest.mark.parametrize(("job", "name"), QUICK)
def test_five_rows_with_an_effect_on_agree_with_solves(job, name):
    key, values = next(iter(MACHINES[job][1].items()))
    span, unit = values.split(" ")
    first, last, step = map(float, span.split(":"))
    scene = machine(job).with_effect(*choices(job)[name])
    assert rows_that_differ(scene, {key: f"{first}:{last}:{5 * step} {unit}"}) == {}


@pytest.mark.few(0, slow=8)
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("job", "name"), CASES)
def test_every_row_with_an_effect_on_agrees_with_a_solve(job, name, axis):
    key = list(MACHINES[job][1])[axis]
    scene, over = machine(job).with_effect(*choices(job)[name]), {key: MACHINES[job][1][key]}
    if name == "speed_fluctuation":
        for refused in (lambda: lo.solve(scene), lambda: lo.sweep(scene, over)):
            with pytest.raises(BadInput, match="solve does not cover effect speed_fluctuation"):
                refused()
        return
    assert rows_that_differ(scene, over) == {}
