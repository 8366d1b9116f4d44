"""Many machines at once: every figure of each is that of the machine alone, and one that cannot move has none."""

import math

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.maths import turning_points
from loomopt.model.machines import BLOCK, Machines, read_all
from loomopt.model.sampling import sampled

CASES = [
    ("beatup", (), ("l1", "l2", "l3", "l4", "M0", "speed", "inertia.J4"), 2e-4),
    ("beatup", (), ("l1", "l2", "l3", "l4", "M0"), 5e-2),
    ("beatup", ("gravity", "bearing_friction", "rod_inertia", "centrifugal"), ("l1", "l4", "gravity.offset"), 1e-2),
    ("rapier", (), ("l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40"), 2e-4),
    ("rapier", (), ("l4", "C0x", "l1", "l71", "phi30", "s_dwell"), 3e-3),
    ("rapier", ("head_inertia", "tape_friction"), ("l4", "l6", "speed"), 1e-3),
    ("shedding", (), ("K1", "X0"), 5e-2),
    ("shedding", ("dry_friction", "damping"), ("K1", "travel", "speed", "rise", "inertia.M"), 1e-3),
    ("shedding-static", (), ("K1", "weight.G"), 1e-2),
]
FEW = 6
"""Machines of each case that are read alone too."""
CLOSE = 8e-12
"""Of a figure's own size: the quartic's top, and a dwell's end by Newton's method."""
AT_A_TOP = 1e-8
"""Of an angle where a curve is highest: it is level there, so that rounding shows by its root."""


def drawn(problem, effects, names, share, count=FEW):
    scene = registry.load(problem)
    for effect in effects:
        scene = scene if effect in scene.effects else scene.with_effect(effect)
    job = registry.of(scene)
    known = job.numbers(scene)
    full = {name: next(key for key in (scene.full(name), name, f"effects.{name}") if key in known) for name in names}
    generator = np.random.default_rng(3)
    shares = 1 + share * generator.uniform(-1.0, 1.0, (len(names), count))
    return (
        scene,
        job,
        known,
        {full[name]: known[full[name]] * values for name, values in zip(names, shares, strict=True)},
    )


def figures(scene, job, known, drawn, request=None):
    model = job.model(scene)
    read = job.figures_of if request is None else lambda scene, of: job.figures_of(scene, of, request)

    def alone(values):
        try:
            second_figures = job.figures(scene, {name: values[name] for name in drawn})
        except ValueError:
            return {}
        return {name: value for name, value in second_figures.items() if value is not None}

    return read_all(model, {**known, **drawn}, sampled(model, known), lambda of: read(scene, of), alone)


@pytest.mark.few(4)
@pytest.mark.parametrize(("problem", "effects", "names", "share"), CASES)
def test_every_figure_is_that_of_the_machine_alone(problem, effects, names, share):
    scene, job, known, values = drawn(problem, effects, names, share)
    second_figures = figures(scene, job, known, values)
    for k in range(FEW):
        first = job.figures(scene, {name: float(value[k]) for name, value in values.items()})
        for name, value in first.items():
            if value is None:
                assert name not in second_figures or not math.isfinite(second_figures[name][k]), name
                continue
            size = max(abs(value), 1e-3 * float(np.abs(second_figures[name]).max()))
            tolerance = AT_A_TOP if name == "contact_angle" else CLOSE
            # A least force near zero is a difference of forces as large as the largest.
            size = max(size, abs(first["contact_max"])) if name == "contact_min" else size
            assert second_figures[name][k] == pytest.approx(value, rel=0, abs=tolerance * size), name


def test_two_tops_that_nearly_tie_are_both_refined():
    """Rise and return are mirrored: whichever the grid shows higher, the other may be."""
    scene, job, known, values = drawn("shedding", (), ("K1", "X0"), 1e-9, 64)
    model = job.model(scene)
    tilted = {**known, **values, "return": known["return"] * (1 + 1e-9 * np.linspace(-1.0, 1.0, 64))}
    tilted["far_dwell"] = known["far_dwell"] + known["return"] - tilted["return"]
    many = Machines(model, tilted, sampled(model, known)).peak("lift")
    for k in (0, 20, 40, 63):
        items = {name: float(value[k]) if np.ndim(value) else value for name, value in tilted.items()}
        assert many[k] == pytest.approx(sampled(model, items).peak("lift"), abs=1e-9)


def test_a_machine_that_cannot_move_has_no_figure_and_the_others_do():
    scene, job, known, values = drawn("rapier", (), ("l4", "l5", "l6", "C0x"), 0.3, 40)
    second_figures = figures(scene, job, known, values, ("stroke", "mu_min"))
    bad = np.isnan(second_figures["stroke"])
    assert 0 < bad.sum() < 40
    for k in range(40):
        try:
            first = job.figures(scene, {name: float(value[k]) for name, value in values.items()})["stroke"]
        except ValueError:
            first = math.nan
        assert (first != first) == bad[k]
        assert bad[k] or second_figures["stroke"][k] == pytest.approx(first, rel=1e-12)


def test_machines_whose_corners_change_places_are_read_each_in_its_own_order():
    """Gravity apart, the pulse's begin passes rear dead centre where it lasts as long as the way to it."""
    scene, job, known, _ = drawn("beatup", ("bearing_friction",), (), 0.0)
    name = next(key for key in known if key.endswith("pulse"))
    values = {name: np.linspace(0.2, 6.0, 24)}
    second_figures = figures(scene, job, known, values)
    for k in range(24):
        first = job.figures(scene, {name: float(values[name][k])})
        for figure in ("peak_torque", "pulse_rms"):
            assert second_figures[figure][k] == pytest.approx(first[figure], rel=CLOSE), (figure, k)


def test_the_same_bits_whatever_stands_beside_a_machine():
    scene, job, known, values = drawn("beatup", (), ("l1", "l2", "M0"), 1e-3, BLOCK + 7)
    whole = figures(scene, job, known, values)
    parts = [
        figures(scene, job, known, {n: v[part] for n, v in values.items()}) for part in (np.s_[:BLOCK], np.s_[BLOCK:])
    ]
    for name, value in whole.items():
        assert np.array_equal(value, np.concatenate([part[name] for part in parts])), name


def test_crossings_of_many_functions_at_once():
    roots = np.array([0.1, 0.5, 2.9])
    powers = np.array([1, 3, 7])

    def excess(x, which):
        return x ** powers[which] - (roots**powers)[which], powers[which] * x ** (powers[which] - 1)

    result = turning_points.crossings(excess, np.zeros(3), np.full(3, 4.0))
    assert result == pytest.approx(roots, rel=1e-15)
