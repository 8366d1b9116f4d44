"""What higher orders do: followed along designs that keep what binds, not along straight lines."""

import numpy as np
import pytest
from support import toy
from support.rapiers import ROOM

import loomopt as lo
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate.certificate import SECOND_ORDER_OPEN, certify
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set
from loomopt.solving.certificate.second_order import FeasibleCurve, Lagrangian

ROUND = {"f": lambda v: -((v["x"] ** 2 + v["y"] ** 2) ** 2), "r": lambda v: v["x"] ** 2 + v["y"] ** 2}
"""On the circle r = 1 all is level; along its tangent f + 2 r falls by the fourth power of the step."""


def reasons(program, **x):
    return certify(program, x, 1e-8).reasons


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0])
def test_what_falls_along_the_tangent_alone_is_level(angle):
    circle = toy.program("xy", ROUND, limits=(("r", 0, 1.0),))
    x = {"x": float(np.cos(angle)), "y": float(np.sin(angle))}
    tangent = {"x": -x["y"], "y": x["x"]}
    assert Lagrangian(circle, x, 0, {0: 2.0}, {}).falls(tangent, 0.0)
    certificate = certify(circle, x, 1e-8)
    assert certificate.reasons == ()
    assert (certificate.minimum, certificate.unique) == (True, False)


@pytest.mark.parametrize(("tilt", "falls"), [(0.0, False), (1.0, True), (-1.0, True)])
def test_what_falls_along_the_curve_is_refused(tilt, falls):
    """On the circle y³ is odd: it falls to one side of (1, 0)."""
    rows = ROUND | {"f": lambda v: ROUND["f"](v) + tilt * v["y"] ** 3}
    result = reasons(toy.program("xy", rows, limits=(("r", 0, 1.0),)), x=1.0, y=0.0)
    texts = ("second order does not decide: f falls along a direction without curvature",)
    assert result == (texts if falls else ())


def test_a_fall_within_the_first_probe_alone_is_left_open():
    """x² + y³ falls below y = 0, but y ≥ −0.001, which does not touch, ends it before a probe shows it."""
    rows = {"f": lambda v: v["x"] ** 2 + v["y"] ** 3}
    assert reasons(toy.program("xy", rows, limits=(("y", -1, -1e-3),)), x=0.0, y=0.0) == (SECOND_ORDER_OPEN,)
    near = reasons(toy.program("xy", rows, limits=(("y", -1, -4e-3),)), x=0.0, y=0.0)
    assert near == ("second order does not decide: f falls along a direction without curvature",)
    assert SECOND_ORDER_OPEN == "second order open"


def curve(rows, limits, sums, curved=(), waves=None, **x):
    program = toy.program(list(x), rows, waves, limits=limits)
    sampler = Sampler(program.model, x)
    active = active_set(program, sampler)
    sums = np.array([[*row, *[0.0] * (len(active.rows) - len(row))] for row in sums]).reshape(-1, len(active.rows))
    jacobian = sums @ MpmathDerivatives(program, x, sampler, active.rows).gradients()
    basis = np.linalg.svd(jacobian)[2][len(sums) :].T if len(sums) else np.eye(len(x))
    vectors = np.array(curved).reshape(-1, basis.shape[1]).T
    bends = np.full(vectors.shape[1], 2.0)
    result = FeasibleCurve(program, x, active.rows, dict.fromkeys(x, 1.0), sums, jacobian, basis, vectors, bends)
    return program, result


@pytest.mark.parametrize("step", [1e-2, -0.3])
def test_steps_are_corrected_onto_what_binds(step):
    _, result = curve(ROUND, (("r", 0, 1.0),), [[1.0]], x=0.6, y=0.8)
    (there,) = result.at([np.array([step])])
    assert np.hypot(there["x"], there["y"]) == pytest.approx(1.0, abs=1e-12)
    way = result.basis[:, 0]
    assert (np.array([there["x"], there["y"]]) - [0.6, 0.8]) @ way == pytest.approx(step, abs=1e-14)


def test_no_design_is_made_up_where_nothing_keeps_what_binds():
    _, result = curve(ROUND, (("r", 0, 1.0),), [[1.0]], x=0.6, y=0.8)
    assert result.at([np.array([2.0])]) == [None]


@pytest.mark.parametrize(("fourth", "verdict"), [(0.9, "falls"), (1.1, "holds")])
def test_directions_that_are_curved_move_to_where_the_least_is(fourth, verdict):
    """v² − 2 v w² + c w⁴ is (c − 1) w⁴ at v = w², though c w⁴ > 0 straight along w."""
    rows = {"f": lambda z: z["v"] ** 2 - 2 * z["v"] * z["w"] ** 2 + fourth * z["w"] ** 4}
    program, result = curve(rows, (), [], [[1.0, 0.0]], v=0.0, w=0.0)
    lagrangian = Lagrangian(program, {"v": 0.0, "w": 0.0}, 0, {}, {})
    assert result.verdict(lagrangian, np.array([0.0, 1.0]), 0.0) == verdict


def wave(m, v, phi):
    return (v["x"] ** 2 + v["y"] ** 2) * m.cos(phi - 3 * v["y"])


@pytest.mark.parametrize("sign", [0, 1])
def test_extremes_of_the_cycle_move_along(sign):
    """Its peak is r, whose place moves with y: at a frozen angle another curve than the circle would be kept."""
    sums = [[float(k == sign) for k in range(2)]]
    _, result = curve({"f": ROUND["f"]}, (("wave", 1, 1.0),), sums, waves={"wave": wave}, x=1.0, y=0.0)
    assert [row.sign for row in result.rows[:2]] in ([1.0, -1.0], [-1.0, 1.0])
    assert result.at([np.array([0.02])])[0]["x"] == pytest.approx(np.sqrt(1 - 0.02**2), abs=1e-12)


@pytest.mark.slow
def test_a_rapier_with_little_room_that_may_be_turned_as_a_whole_is_certified():
    answer = lo.solve(lo.load("rapier").update(ROOM))
    assert answer.status == "optimal", answer.message
    assert not answer.certificate.unique
    turned = {**answer.design}
    C0 = complex(turned["C0x"], turned["C0y"]) * np.exp(1e-3j)
    turned |= {"C0x": C0.real, "C0y": C0.imag, "alpha": turned["alpha"] + 1e-3, "phi40": turned["phi40"] + 1e-3}
    alike = lo.evaluate(lo.load("rapier").update(ROOM), turned)
    assert alike.figures["peak_acceleration"] == pytest.approx(answer.figures["peak_acceleration"], rel=1e-11)
