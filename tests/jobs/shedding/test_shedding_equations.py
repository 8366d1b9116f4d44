"""Printed equations are the ones that are computed: read back by SymPy and compared with the kernel's numbers."""

import math

import numpy as np
import pytest
import sympy as sp

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.shedding import drawing, views
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms.cam_follower import Contact, Follower
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_spline import cycloid_like, spline

SCENE = lo.load("shedding")
LOADS = ("weight", "warp_tension", "inertia", "damping", "dry_friction")
KEYS = {"weight": ["G"], "warp_tension": ["T1", "T2"], "inertia": ["M"], "damping": ["C"], "dry_friction": ["F"]}
KEYS["coil"] = ["wire", "turns", "shear_modulus"]


def with_effects(*names):
    scene = SCENE
    for name in (*LOADS, "coil"):
        scene = scene.with_effect(name) if name in names else scene.without_effect(name)
    return scene


def printed(scene, name):
    return [equation.text for equation in registry.of(scene).views.equations(scene) if equation.name == name]


def all_of(scene):
    return {equation.text.split(" = ")[0]: equation.text for equation in registry.of(scene).views.equations(scene)}


def plain(text):
    return (
        text.replace("^", "**")
        .replace("''", "_2")
        .replace("'", "_1")
        .replace("return", "back")
        .replace("_(k+1)", "_next")
    )


def value(text, **known):
    """Return a formula's value; names with primes as _1, _2, `return` as back."""
    expression = sp.parse_expr(plain(text), local_dict={name: sp.Symbol(name) for name in (*known, "N", "C", "S", "E")})
    assert {symbol.name for symbol in expression.free_symbols} <= set(known)
    return float(expression.subs({sp.Symbol(name): sp.Float(number, 30) for name, number in known.items()}))


def formulas(text):
    """Return the left side and the formulas with their conditions of a printed equation."""
    left, right = text.split(" = ", 1)
    parts = [part.rsplit(" for ", 1) for part in right.split(", ")]
    return left, [(part[0], part[1] if len(part) > 1 else None) for part in parts]


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.few(2)
def test_every_named_law_is_printed_as_it_is_computed(name):
    scene = SCENE.set("mechanism.law", name)
    texts = printed(scene, f"cam law {name}")
    assert [text.split(" = ")[0] for text in texts] == ["s", "s'", "s''"]
    edges = [0.0, *map(float, LAWS[name].breaks), 1.0]
    for order, text in enumerate(texts):
        _, pieces = formulas(text)
        assert len(pieces) == len(edges) - 1
        for piece, (formula, condition) in enumerate(pieces):
            if condition:
                low, high = (sp.Rational(end) for end in condition.split(" <= u <= "))
                assert [float(low), float(high)] == edges[piece : piece + 2]
            for share in (0.0, 0.3, 0.8, 1.0):
                u = edges[piece] + share * (edges[piece + 1] - edges[piece])
                exact = LAWS[name].formula(systems.mpmath(30), systems.mpmath(30).number(u), piece)[order]
                assert value(formula, u=u) == pytest.approx(float(exact), rel=1e-12, abs=1e-13)


def test_named_laws_are_printed_shortly():
    longest = {name: max(map(len, printed(SCENE.set("mechanism.law", name), f"cam law {name}"))) for name in LAWS}
    assert printed(SCENE, "cam law cycloidal")[0] == "s = u - sin(2*pi*u)/(2*pi)"
    assert printed(SCENE.set("mechanism.law", "gutman_13"), "cam law gutman_13")[0].count("sin") == 2
    assert max(longest.values()) < 450


def test_a_spline_law_is_printed_on_the_interval_between_two_knots():
    knots = cycloid_like(10)
    scene = SCENE.update({"mechanism.law": "spline", "mechanism.law_coefficients": list(knots)})
    kind = "cam law spline, k = 0 ... 9"
    result = dict(text.split(" = ") for text in printed(scene, kind))
    made, k, u = spline(FLOAT, knots), 3, 0.337
    known = {f"{letter}_k": getattr(made, letter)[k] for letter in "sva"} | {"a_next": made.a[k + 1]}
    known["t"] = value(result["t"], u=u, k=k)
    for name, exact in zip(("s", "s'", "s''"), made.at(FLOAT, u, k), strict=False):
        assert value(result[name], **known) == pytest.approx(exact, rel=1e-12)
    assert printed(scene, "cam law, at rest at both ends") == ["s_0 = 0", "v_0 = 0", "s_10 = 1", "v_10 = 0"]


def test_a_law_from_a_table_says_so(tmp_path):
    rows = "\n".join(f"{12 * k},{65.6 * (k / 10 - math.sin(2 * math.pi * k / 10) / 2 / math.pi)!r}" for k in range(11))
    (tmp_path / "law.csv").write_text(f"angle [deg],s [mm]\n{rows}\n")
    scene = SCENE.update({"mechanism.law": "table", "mechanism.law_table": str(tmp_path / "law.csv")})
    (message,) = printed(scene, "cam law table")
    assert message == "s(u): the C2 cubic through the table's 11 points (u, s), s' = 0 at both ends"


@pytest.mark.parametrize("theta", [0.4, 1.3, 2.6, 4.0, 5.6])
def test_printed_motion_is_the_frames(theta):
    scene = SCENE.update({f"mechanism.{name}": f"{angle} deg" for name, angle in zip(
        ("rise", "far_dwell", "return", "near_dwell"), (100, 70, 130, 60), strict=True)})  # fmt: skip
    rise, far, back, _ = (math.radians(angle) for angle in (100, 70, 130, 60))
    known = {"rise": rise, "far_dwell": far, "back": back, "theta": theta, "travel": scene.mechanism["travel"]}
    ends = [0, rise, rise + far, rise + far + back, 2 * math.pi]
    segment = next(k for k in range(4) if theta <= ends[k + 1])
    places = (" in the rise", " in the far dwell", " in the return", " in the near dwell")
    texts = {text.split(" = ")[0]: text.split(" = ")[1] for text in printed(scene, "travel")}
    texts["u"] = printed(scene, "argument of the law")[0].split(" = ")[1]

    def here(name):
        (formula,) = [part for part in texts[name].split(", ") if part.endswith(places[segment])]
        return formula.removesuffix(places[segment])

    u = value(here("u"), **known)
    law = dict(zip(("s", "s_1", "s_2"), LAWS["cycloidal"].formula(FLOAT, u, 0)[:3], strict=True))
    at = drawing.cam(scene, {}).at(np.array([theta]))
    frame = lo.simulate(scene)
    for name, column in (("X", "X [m]"), ("X'", "X_1 [m/rad]"), ("X''", "X_2 [m/rad^2]")):
        exact = np.interp(theta, frame["phi [rad]"][:-1], frame[column][:-1])
        assert value(here(name), **known, **law) == pytest.approx(exact, abs=2e-5)
    assert value(here("X"), **known, **law) == pytest.approx(float(at.X[0]), rel=1e-12)


def test_segments_that_are_not_there_are_not_printed():
    scene = SCENE.update({"mechanism.far_dwell": "0 deg", "mechanism.near_dwell": "120 deg"})
    words = " ".join(equation.text for equation in registry.of(scene).views.equations(scene))
    assert "near dwell" in words
    assert "far dwell" not in words


@pytest.mark.parametrize("on", [(), ("weight",), ("warp_tension", "inertia"), LOADS, (*LOADS, "coil")])
def test_an_effect_has_its_term_and_its_symbols_exactly_when_it_is_on(on):
    equations = registry.of(SCENE).views.equations(with_effects(*on))
    names = [equation.name for equation in equations]
    assert "return_spring" in names
    (balance,) = (equation.text for equation in equations if equation.name == "balance")
    terms = {f"N_{name}" for name in ("return_spring", *on) if name != "coil"}
    assert set(balance.removeprefix("N = ").split(" + ")) == terms
    words = set(
        " ".join(f" {equation.text} " for equation in equations).translate(str.maketrans("*/^()+-,", " " * 8)).split()
    )
    for effect, symbols in KEYS.items():
        assert (effect in names) == (effect in on)
        for symbol in symbols:
            assert (symbol in words) == (effect in on), symbol
    assert ("omega" in words) == bool({"inertia", "damping", "coil"} & set(on))


def test_printed_terms_are_the_effects_own():
    scene = with_effects(*LOADS)
    texts = all_of(scene)
    assert texts["N_return_spring"] == "N_return_spring = K1*(X + X0)"
    assert texts["N_weight"] == "N_weight = -G"
    assert texts["N_inertia"] == "N_inertia = M*X''*omega^2"
    assert texts["N_damping"] == "N_damping = C*X'*omega"
    _, ((above, top), (below, bottom)) = formulas(texts["N_warp_tension"])
    assert (top, bottom) == ("0 <= X <= travel/2", "travel/2 <= X <= travel")
    known = {"travel": 0.0656, "T1": 124.545, "T2": 83.03}
    assert value(above, X=0.0, **known) == pytest.approx(-124.545)
    assert value(above, X=0.0328, **known) == pytest.approx(value(below, X=0.0328, **known), abs=1e-20)
    assert value(below, X=0.0656, **known) == pytest.approx(83.03)
    open_ended = "any value of -F ... F (-F for contact)"
    friction = f"F in the rise, {open_ended} in the far dwell, -F in the return, {open_ended} in the near dwell"
    assert texts["N_dry_friction"] == f"N_dry_friction = {friction}"
    assert texts["cam_torque"] == "cam_torque = N*X'"
    assert printed(scene, "contact") == ["N >= N_min for every theta"]


def test_every_shape_of_the_warps_pull_is_printed_as_it_is():
    step = all_of(SCENE.set("effects.warp_tension.shape", "step"))["N_warp_tension"].split(" = ")[1]
    for u, pull in ((0, -124.545), (1, 83.03), (0.5, (83.03 - 124.545) / 2)):
        assert value(step, u=u, T1=124.545, T2=83.03) == pytest.approx(pull)
    levels = lo.load("shedding-static")
    known = "not known in the rise, T2 in the far dwell, not known in the return, -T1 in the near dwell"
    assert all_of(levels)["N_warp_tension"] == f"N_warp_tension = {known}"
    assert printed(levels, "contact") == ["N >= N_min in the far dwell and in the near dwell"]


def test_the_printed_follower_is_the_kernels():
    follower = Follower(0.13, 0.14, 0.05, 0.02, 0.2164)
    phi, phi_1, phi_2, theta = 0.1, 0.17, -0.31, 1.4
    at = Contact(FLOAT, follower, phi, phi_1, phi_2)
    texts = {left: text.split(" = ", 1)[1] for left, text in all_of(SCENE).items() if " = " in text}
    known = vars(follower) | {"phi": phi, "phi_1": phi_1, "phi_2": phi_2, "theta": theta}
    known["phi0"] = value(texts["phi0"], **vars(follower))
    assert known["phi0"] == pytest.approx(follower.start_angle(FLOAT), rel=1e-14)
    known["w"] = value(texts["w"], **known)
    known |= {"x": value(texts["x"], **known), "y": value(texts["y"], **known)}
    known["curvature"] = value(texts["curvature"], **known)
    exact = {"x": at.centre(theta).x, "y": at.centre(theta).y, "w": at.speed, "curvature": at.curvature}
    exact |= {"x_p": at.profile(theta).x, "y_p": at.profile(theta).y}
    exact |= {"pressure_angle": at.pressure_angle, "profile_curvature": at.profile_curvature}
    for name, number in exact.items():
        assert value(texts[name], **known) == pytest.approx(number, rel=1e-12), name
    assert value(texts["phi''"], X_2=2.0, arm_swing=0.2164, travel=0.0656) == pytest.approx(2 * 0.2164 / 0.0656)


def test_without_follower_nothing_of_it_is_printed():
    document = {table: dict(values) for table, values in SCENE.document.items()}
    del document["mechanism"]["arm"]
    scene = lo.scene(document)
    names = {equation.name for equation in registry.of(scene).views.equations(scene)}
    assert not names & {"follower", "roller centre", "pressure angle", "profile"}
    assert "contact" in names


def test_printed_rows_of_the_coil_are_its_figures_and_what_it_keeps():
    scene = lo.load("shedding-printed-travel").with_effect("coil")
    job = registry.of(scene)
    design = job.today(scene)
    figures = job.figures(scene, design)
    known = {name.rpartition(".")[2]: number for name, number in job.numbers_of(scene, design).items()}
    known["omega"] = known.pop("speed")
    known["back"] = known.pop("return")
    texts = [text for text in printed(scene, "coil") if " = " in text]
    assert len(texts) == 7
    for text in texts:
        name, formula = text.split(" = ")
        needed = {key: number for key, number in known.items() if key in plain(formula)}
        assert value(formula, **needed) == pytest.approx(figures[name], rel=1e-9), name
    subset = [text for text in printed(scene, "coil") if " = " not in text]
    assert subset == [
        "coil_index >= 4",
        "coil_index <= 12",
        "shear_share <= shear_share_max",
        "bending_share <= bending_share_max",
        "surge_ratio >= surge_ratio_min",
        "spring_length <= spring_length_max",
    ]
    (rate,) = printed(scene, "coil: coils give K1")
    assert rate.endswith(" = 0")


@pytest.mark.parametrize("name", ["shedding", "shedding-static"])
def test_latex_is_balanced_and_has_the_papers_letters(name):
    scene = lo.load(name)
    latex = " ".join(equation.latex for equation in registry.of(scene).views.equations(scene))
    assert latex.count("{") == latex.count("}")
    assert latex.count(r"\begin{cases}") == latex.count(r"\end{cases}") > 4
    for symbol in (r"\phi_{0}", r"\theta", r"N \ge N_{\mathrm{min}}", r"K_{1}", r"\text{in the far dwell}"):
        assert symbol in latex


def test_an_expanded_formula_is_the_same_function():
    u = sp.Symbol("u", real=True)
    raw = LAWS["freudenstein_13"].formula(systems.sympy(), u, 0)
    for formula in raw[:3]:
        short = views.expanded(formula, u)
        assert len(str(short)) < len(str(formula))
        assert sp.N((short - formula).subs(u, sp.Rational(2, 7)), 30) == pytest.approx(0, abs=1e-25)
