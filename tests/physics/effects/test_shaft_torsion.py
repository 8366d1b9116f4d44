"""The twisting shaft: its reference figures by the product and by an integrator, its energy, what it refuses."""

import functools
import math

import casadi as ca
import numpy as np
import pytest
from twisting_shafts import (
    CENTRES,
    HALF,
    J4,
    M0,
    OMEGA,
    PLAIN,
    RIGID,
    SLOPE,
    one_percent,
    sampler,
    twist,
)

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.maths.jets import Jet, variables
from loomopt.maths.systems import FLOAT
from loomopt.model import model
from loomopt.physics.cycle import TURN, Node
from reference import turn as plain_turn

TABLE = {
    (2e4, one_percent(2e4), True): (-1651.261880486, -0.0820964270, 192.496773, 1707.20032),
    (5e4, one_percent(5e4), True): (-639.005120699, -0.0128729824, 175.5296867, 944.7892262),
    (2e5, one_percent(2e5), True): (753.536638648, 0.00357218826, 538.9743285, 3107.780597),
    (5e5, 22.0, True): (454.1827338289, 8.852504830e-4, None, None),
    (2e6, 45.0, True): (-85.4233569678, -4.172197028e-5, 94.1752140166, 757.46989414),
    (5e5, 22.0, False): (-741.2973570105, None, None, None),
}
"""k, c, whether the cloth resists → M3_fdc, N·m, z(β), rad, peak_torque, shaft_peak, to the digits of their source."""
every = pytest.mark.parametrize("case", TABLE, ids=lambda case: f"k={case[0]:g}, c={case[1]:.3g}, {case[2]}")


def digits(value):
    """Return half a unit of the last digit that is given, and no more than 1e-9 of it."""
    given = repr(value).split("e")[0].split(".")[1]
    exponent = int(repr(value).split("e")[1]) if "e" in repr(value) else 0
    return max(0.51 * 10.0 ** (exponent - len(given)), 1e-9 * abs(value))


@every
def test_reference_figures_in_floats_and_in_40_digits(case):
    second_sampler = sampler(*case)
    many = second_sampler.read(systems.mpmath())
    values = {
        "M3_fdc": (second_sampler.static["M3_fdc"], many.single("M3_fdc")),
        "z": (float(twist(second_sampler, CENTRES.beta)), None),
        "peak_torque": (second_sampler.peak("peak_torque"), peak(second_sampler, many, "peak_torque")),
        "shaft_peak": (second_sampler.peak("shaft_peak"), peak(second_sampler, many, "shaft_peak")),
    }
    for expected, (value, many_digits) in zip(TABLE[case], values.values(), strict=True):
        if expected is not None:
            assert value == pytest.approx(expected, rel=0, abs=digits(expected))
        if many_digits is not None:
            assert value == pytest.approx(float(many_digits), rel=1e-11)


def peak(result, many, name):
    """Return |quantity| in many digits where it is largest."""
    top = result.extremes(name)[0]
    return abs(many.at(name, top.piece, many.maths.number(top.u)))


STAGES, STRIDE = 10, 0.5
"""Gauss's collocation of order 20, at steps in which the free shaft turns by no more than so many radians."""


@functools.cache
def collocation():
    """Return nodes c, weights b and matrix a of Gauss's method on [0, 1] [Hairer and Wanner, section IV.5]."""
    legendre = np.polynomial.legendre
    x, weights = legendre.leggauss(STAGES)
    integrals = [legendre.Legendre.basis(k).integ(lbnd=-1)(x) for k in range(STAGES)]
    return (x + 1) / 2, weights / 2, np.column_stack(integrals) @ np.linalg.inv(legendre.legvander(x, STAGES - 1)) / 2


@functools.cache
def shot(case, ends):
    """Return z and z˙ at the ends of pieces of the turn, by shooting: an integrator knows nothing of harmonics.

    ends: crank angles, rad, in order, the pulse's corners among them; from the first a turn on. The rocker's motion is
    by its own loop too.
    """
    k, c, resisted = case
    nodes, weights, matrix = collocation()
    free = np.array([[0.0, 1.0], [-k / J4, -c / J4]]) / OMEGA
    y, result = np.eye(2, 3), []
    for begin, end in zip(ends, (*ends[1:], ends[0] + TURN), strict=True):
        inside = abs(math.remainder((begin + end) / 2 - CENTRES.beta, TURN)) < HALF
        result.append(y)
        count = math.ceil((end - begin) * max(1.0, math.sqrt(k / J4) / OMEGA) / STRIDE)
        h = (end - begin) / count
        whole = np.eye(2 * STAGES) - h * np.kron(matrix, free)
        for step in range(count):
            pushed = np.zeros((STAGES, 2, 3))
            for j, phi in enumerate(begin + h * (step + nodes)):
                away = math.remainder(phi - CENTRES.beta, TURN)
                force = M0 * math.cos(math.pi * away / (2 * HALF)) if resisted and inside else 0.0
                pushed[j, 1, 2] = (force / J4 - plain_turn.rocker(phi)[1] * OMEGA**2) / OMEGA
            rates = np.linalg.solve(whole, (free @ y + pushed).reshape(-1, 3)).reshape(STAGES, 2, 3)
            y = y + h * np.tensordot(weights, rates, axes=1)
    start = np.linalg.solve(np.eye(2) - y[:, :2], y[:, 2])
    return [item @ np.array([*start, 1.0]) for item in result]


@every
def test_reference_figures_by_shooting_with_an_integrator(case):
    """At front dead centre and where the product has its peaks, z, M3 and the crank torque are those of the ODE."""
    k, c, _ = case
    second_sampler = sampler(*case)
    tops = {name: second_sampler.extremes(name)[0] for name in ("peak_torque", "shaft_peak")}
    at = {name: second_sampler.angle(top) % TURN for name, top in tops.items()} | {"M3_fdc": CENTRES.beta}
    ends = sorted({*at.values(), CENTRES.beta - HALF, CENTRES.beta + HALF})
    shots = dict(zip(ends, shot(case, tuple(ends)), strict=True))
    expected = dict(zip(("M3_fdc", "z", "peak_torque", "shaft_peak"), TABLE[case], strict=True))
    for name, phi in at.items():
        z, speed = shots[phi]
        torque = k * z + c * speed
        shown = second_sampler.static["M3_fdc"] if name == "M3_fdc" else second_sampler.peak(name)
        if name == "peak_torque":
            torque *= plain_turn.rocker(phi)[0]
        size = 1.0 if name == "M3_fdc" else math.copysign(1.0, torque)
        assert size * torque == pytest.approx(shown, rel=1e-11)
        if expected[name] is not None:
            assert size * torque == pytest.approx(expected[name], rel=0, abs=digits(expected[name]))
    assert shots[CENTRES.beta][0] == pytest.approx(float(twist(second_sampler, CENTRES.beta)), rel=1e-11)
    if expected["z"] is not None:
        assert shots[CENTRES.beta][0] == pytest.approx(expected["z"], rel=0, abs=digits(expected["z"]))


@every
def test_no_angle_exceeds_a_peak(case):
    second_sampler = sampler(*case)
    for name in ("peak_torque", "shaft_peak", "twist_peak"):
        pieces, u = second_sampler.grid(20000)
        values = np.abs(second_sampler.at(name, pieces, u))
        assert second_sampler.peak(name) * (1 - 1e-4) < values.max() <= second_sampler.peak(name) * (1 + 1e-13)


@pytest.mark.few(1)
@pytest.mark.parametrize(("k", "ratio"), [(2e6, 1.3), (2e6, 3.0), (5e5, 10.0), (3e5, 43.0)])
def test_peaks_of_an_overdamped_shaft_are_found_beside_the_corners_of_the_pulse(k, ratio):
    """What decays there does so 2 ratio times as fast as the shaft would swing."""
    second_sampler = sampler(k, 2 * ratio * math.sqrt(k * J4))
    pieces, u = second_sampler.grid(400_000)
    values = np.abs(second_sampler.at("shaft_peak", pieces, u))
    assert values.max() <= second_sampler.peak("shaft_peak") * (1 + 1e-10)


def test_the_largest_torque_of_the_packaged_shaft_is_where_it_was_found():
    second_sampler = sampler(2e6, 45.0)
    assert math.degrees(second_sampler.angle(second_sampler.extremes("shaft_peak")[0])) % 360 == pytest.approx(
        82.02645, abs=5e-6
    )
    scene = PLAIN.with_effect("shaft_torsion")
    assert lo.evaluate(scene).figures["M3_fdc"] == pytest.approx(-85.4233569678, rel=1e-9)


# What becomes of it as the shaft stiffens --------------------------------------------------------------------------


def formula(k, c, resisted):
    """Return M3 at front dead centre in 40 digits by the formula itself, however stiff the shaft."""
    base = sampler(2e6, 45.0, resisted)
    many = systems.mpmath()
    values = {**base.values, "shaft_torsion.stiffness": k, "shaft_torsion.damping": c}
    given = base.model.given(many, {name: many.number(value) for name, value in values.items()})
    return base.model.static(many, given, base.stills, ("M3_fdc",))["M3_fdc"]


def rigid(resisted):
    scene = PLAIN if resisted else PLAIN.without_effect("resistance")
    return registry.of(scene).sampler(scene, {}).read(systems.mpmath()).single("M3_fdc")


def test_without_resistance_the_error_of_a_rigid_shaft_falls_as_one_over_k():
    """From scenes as stiff as they may be, then by the formula."""
    assert float(rigid(False)) == pytest.approx(RIGID, rel=1e-12)
    stiffnesses = (1e6, 1e7, 9e7, 1e8, 1e9, 1e10)
    from_scenes = [
        sampler(k, one_percent(k), False).read(systems.mpmath()).single("M3_fdc") for k in stiffnesses if k < 9.7e7
    ]
    by_formula = [formula(k, one_percent(k), False) for k in stiffnesses]
    assert [float(value) for value in from_scenes] == pytest.approx([float(v) for v in by_formula[:3]], rel=1e-15)
    errors = [float(value - rigid(False)) for value in by_formula]
    for k, error, farther, after in zip(stiffnesses, errors, stiffnesses[1:], errors[1:], strict=False):
        assert math.log(error / after) / math.log(farther / k) == pytest.approx(1.0, abs=0.01)
    assert errors[-1] * 1e10 == pytest.approx(SLOPE, rel=1e-4)


def test_with_resistance_the_corners_of_the_pulse_make_the_shaft_ring():
    """The error has no order: its sign changes, and a hundredfold stiffer shaft is no nearer to the rigid one."""
    errors = {k: float(formula(k, one_percent(k), True) - rigid(True)) for k in (1e6, 1e7, 1e8, 1e9)}
    assert [errors[k] for k in errors] == pytest.approx([195.8, 52.9, -9.2, -0.32], abs=0.06)
    scenes = [sampler(k, one_percent(k)).static["M3_fdc"] - float(rigid(True)) for k in (1e6, 1e7)]
    assert scenes == pytest.approx([errors[1e6], errors[1e7]], rel=1e-9)


# One formula in every number system --------------------------------------------------------------------------------

NODES = [(0, 0.0), (0, 0.37), (0, 1.0), (1, 0.0), (1, 0.11), (1, 0.6), (1, 1.0)]
QUANTITIES = ("peak_torque", "shaft_peak", "twist_peak", "reed_front")


def traced(result):
    """Return the quantities at nodes as CasADi has them."""
    system, symbols = systems.casadi(), {name: ca.SX.sym(name) for name in result.values}
    given, phi, inside = result.model.given(system, symbols), ca.SX.sym("phi"), ca.SX.sym("inside")
    values = [result.model.quantity(system, given, name, Node(phi, {"resistance": inside})) for name in QUANTITIES]
    function = ca.Function("f", [ca.vertcat(*symbols.values()), phi, inside], [ca.vertcat(*values)])
    numbers = [result.values[name] for name in symbols]
    angles = [float(result.cycle.angles(np.array([p]), np.array([u]))[0]) for p, u in NODES]
    switches = [float(result.cycle.switch(p)["resistance"]) for p, _ in NODES]
    return np.array([np.ravel(function(numbers, a, s).full()) for a, s in zip(angles, switches, strict=True)]).T


def test_every_number_system_gives_the_same():
    for case in ((2e6, 45.0), (2e5, 7.0), (1e5, 700.0)):
        second_sampler = sampler(*case)
        many = second_sampler.read(systems.mpmath())
        symbols, balls = traced(second_sampler), second_sampler.read(systems.balls())
        for name, in_symbols in zip(QUANTITIES, symbols, strict=True):
            true = [float(many.at(name, p, many.maths.number(u))) for p, u in NODES]
            size = 1e-12 * max(map(abs, true))
            floats = [second_sampler.read(FLOAT).at(name, p, u) for p, u in NODES]
            arrays = second_sampler.at(name, *map(np.array, zip(*NODES, strict=True)))
            for values in (floats, arrays, in_symbols):
                assert np.asarray(values, dtype=float) == pytest.approx(true, rel=1e-12, abs=size)
            for (p, u), value in zip(NODES[1:5:3], true[1:5:3], strict=True):
                angle = balls.starts[p] + u * (balls.starts[p + 1] - balls.starts[p])
                ball = balls.quantity(name, angle, {"resistance": float(second_sampler.cycle.switch(p)["resistance"])})
                series = systems.ball_series(0.0, 0.0) * 0 + ball
                assert abs(series[0] - value) < 1e-9 * max(map(abs, true))


def test_recordings_give_the_same_bits():
    from loomopt.model.reading import Quantities

    second_sampler = sampler(2e6, 45.0)
    plain = second_sampler.model.together(FLOAT, second_sampler.given, Node(1.0, {"resistance": 1.0}))
    values = Quantities(second_sampler.model, (FLOAT, FLOAT), second_sampler.given)
    for _ in range(70):
        last = values(QUANTITIES, Node(1.0, {"resistance": 1.0}))
    assert list(last) == [plain(name) for name in QUANTITIES]
    assert values._bound


def test_jets_have_the_slopes_and_curvatures_of_40_digits():
    result, many = sampler(2e6, 45.0), systems.mpmath()
    names = ("l1", "l2", "l3", "l4", "m4e", "shaft_torsion.stiffness")
    start = {**result.values, "m4e": 2.0, "r4e": 0.07}
    sizes = np.diag([abs(start[name]) for name in names])
    moving = dict(zip(names, variables([start[name] for name in names], sizes, True), strict=True))
    given = result.model.given(systems.jets(), {**start, **moving})
    phi = np.array([0.5, 2.0, 5.0])
    node = Node(phi, {"resistance": np.zeros(3)})
    jet = result.model.quantity(systems.jets(), given, "shaft_peak", node)
    assert isinstance(jet, Jet)
    step = many.number(10) ** -12

    def at(angle, **shares):
        values = {name: many.number(value) for name, value in start.items()}
        values |= {name: values[name] * (1 + share) for name, share in shares.items()}
        return result.model.quantity(
            many, result.model.given(many, values), "shaft_peak", Node(angle, {"resistance": 0})
        )

    for k, name in enumerate(names):
        low, mid, high = (at(many.number(2.0), **{name: sign * step}) for sign in (-1, 0, 1))
        assert jet.v[1] == pytest.approx(float(mid), rel=1e-12)
        size = np.abs(jet.g[1]).max()
        assert jet.g[1, k] == pytest.approx(float((high - low) / (2 * step)), rel=1e-10, abs=1e-11 * size)
        bend = float((high - 2 * mid + low) / step**2)
        assert jet.curvature[1, k, k] == pytest.approx(bend, rel=1e-8, abs=1e-9 * np.abs(jet.curvature[1]).max())


def test_many_designs_at_once_are_each_of_them():
    second_sampler = sampler(2e6, 45.0)
    l2 = np.array([0.062, 0.065, 0.07])
    given = second_sampler.model.given(systems.numpy(), {**second_sampler.values, "l2": l2})
    node = Node(np.array([[2.0], [5.0]]), {"resistance": 0})
    at_once = second_sampler.model.quantity(systems.numpy(), given, "shaft_peak", node)
    for k, value in enumerate(l2):
        first = second_sampler.model.given(FLOAT, {**second_sampler.values, "l2": float(value)})
        single = [
            second_sampler.model.quantity(FLOAT, first, "shaft_peak", Node(a, {"resistance": 0})) for a in (2.0, 5.0)
        ]
        assert at_once[:, k] == pytest.approx(single, rel=1e-13)


# Energy -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("k", "c"), [(2e6, 45.0), (2e5, 7.0), (1e5, 700.0)])
def test_what_the_crank_gives_is_what_the_cloth_and_the_damper_take(k, c):
    """∮ Md dφ = ∮ M_R dq_r + ∮ c z˙² dt, with z˙ from the torque itself: k z + c z˙."""
    second_sampler = sampler(k, c)
    x, weights = np.polynomial.legendre.leggauss(400)
    crank = cloth = damper = 0.0
    for piece in range(2):
        u = (x + 1) / 2
        at = second_sampler.model.instant(
            systems.numpy(), second_sampler.given, second_sampler.node(np.full(400, piece), u)
        )
        (state,) = second_sampler.model.states
        z, torque = model.read_at(state, at).coordinate(), at.force
        rate = (torque - k * z) / c
        width = np.diff(second_sampler.cycle.starts)[piece] * weights / 2
        crank += float(width @ at.crank_torque)
        cloth += float(width @ (at.terms()["resistance"] * (at.pose.q1 - rate / OMEGA)))
        damper += float(width @ (c * rate**2)) / OMEGA
    assert crank == pytest.approx(cloth + damper, rel=1e-9)
    assert damper > 1e-3
