"""Views of shedding: the cam, its profile, the cam force, and remarks for the designer."""

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, get_args

from loomopt.jobs import registry
from loomopt.jobs.shedding.model import (
    FAR_DWELL,
    FOLLOWER,
    LAW,
    LEAST,
    MOST,
    MOVES,
    NEAR_DWELL,
    RETURN,
    RISE,
    SEGMENT,
    CamFrame,
    CamProgram,
    FrameMotion,
    frame,
    height,
    width,
)
from loomopt.jobs.shedding.scene import LAW_TABLE
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.model.curves import POWER
from loomopt.model.model import JobModel
from loomopt.model.sampling import Sampler, near_zero
from loomopt.physics.balance import Acting, Given
from loomopt.physics.cycle import TURN, Node
from loomopt.physics.effects.kinds import Load, Motion
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_follower import Contact, Follower
from loomopt.physics.mechanisms.cam_laws import LawDerivatives
from loomopt.physics.mechanisms.cam_motion import CamLaw, NamedLaw, Spline, Tabulated, of_knots
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Values
from loomopt.picture import effect_equations
from loomopt.picture.equations import Case, Equation, Expression, cases, equation, relation, sums, symbol, sympy, text
from loomopt.picture.job_views import JobViews, Marks, Span
from loomopt.picture.panels import BY_EFFECT, Curve, Panel
from loomopt.scenes.scene import Scene

PRIMES = ("s", "s'", "s''")


@dataclass(frozen=True)
class Unwritten:
    """Cam law with only a name: s(u) and its derivatives are symbols."""

    law: CamLaw

    @property
    def key(self) -> Hashable:
        """The law's own."""
        return self.law.key

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """The law's own."""
        return self.law.breaks

    @property
    def symmetric(self) -> bool:
        """The law's own."""
        return self.law.symmetric

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Nothing."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> LawDerivatives:
        """Symbols."""
        return LawDerivatives(*(symbol(name) for name in (*PRIMES, "s'''")))


def law(cam_law: CamLaw) -> list[Equation]:
    """S(u) and its first two derivatives: by pieces of u, or by the data of the law."""
    if isinstance(cam_law, Spline):
        return _spline(cam_law)
    if isinstance(cam_law, Tabulated):
        return _table(cam_law.table)
    assert isinstance(cam_law, NamedLaw)
    u, ends = symbol("u"), [Fraction(0), *cam_law.breaks, Fraction(1)]
    pieces = [cam_law.at(systems.sympy(), {}, u, k) for k in range(len(ends) - 1)]
    sp = sympy()
    bounds = list(itertools.pairwise(sp.Rational(end.numerator, end.denominator) for end in ends))
    written = []
    for order, name in enumerate(PRIMES):
        formulas = [
            (expanded(piece[order], u), (low, u, high)) for piece, (low, high) in zip(pieces, bounds, strict=True)
        ]
        written.append(cases(f"cam law {cam_law.name}", symbol(name), formulas))
    return written


@functools.lru_cache(64)
def expanded(formula: Expression, u: Expression) -> Expression:
    """Law's formula as a sum of powers of u and plain sine waves."""
    from sympy.simplify.fu import TR8

    sp = sympy()
    rest = sp.sin(sp.pi * (1 - u) / 2)
    expression = sp.expand(TR8(sp.expand(sp.sympify(formula).subs(rest, sp.cos(sp.pi * u / 2)))))
    waves = expression.atoms(sp.sin, sp.cos)
    if waves and not sp.Poly(expression, *waves).is_linear:
        expression = sp.expand(sp.expand(expression.rewrite(sp.exp)).rewrite(sp.cos))
    return sp.collect(expression, [*sorted(expression.atoms(sp.sin, sp.cos), key=str), u], sp.factor)


def _knots(letter: str, count: int) -> tuple[Expression, ...]:
    """Values at a knot k and the next one, padded to a number of knots."""
    return symbol(f"{letter}_k"), *[symbol(f"{letter}_(k+1)")] * (count - 1)


def _spline(spline: Spline) -> list[Equation]:
    """Write the spline on the interval between knots k and k + 1, t counted from knot k."""
    n = spline.intervals
    made = cam_spline.SplineData(*(_knots(letter, n + 1) for letter in "sva"))
    t, u = symbol("t"), symbol("u")
    at = made.at(systems.sympy(), t, 0)
    kind = f"cam law spline, k = 0 ... {n - 1}"
    ends = [("s_0", 0), ("v_0", 0), (f"s_{n}", 1), (f"v_{n}", 0)]
    return [
        equation(kind, t, u - symbol("k") / n),
        *(equation(kind, symbol(name), at[order]) for order, name in enumerate(PRIMES)),
        *(equation("cam law, at rest at both ends", symbol(name), sympy().Integer(value)) for name, value in ends),
    ]


def _table(table: cam_spline.LawTable) -> list[Equation]:
    """Sentence on the law through a table: a cubic between each point and the next."""
    points = len(table.u)
    text = f"the C2 cubic through the table's {points} points (u, s), s' = 0 at both ends"
    u, k = symbol("u"), symbol("u_k")
    t, jerk = symbol("t"), symbol("j_k")
    s, v, a = (symbol(f"{letter}_k") for letter in "sva")
    kind = f"cam law table, k = 0 ... {points - 2}"
    return [
        Equation("cam law table", f"s(u): {text}", rf"s(u):\ \text{{{text}}}", ((f"s(u): {text}",),)),
        equation(kind, t, u - k),
        equation(kind, symbol("s"), s + v * t + a * t**2 / 2 + jerk * t**3 / 6),
    ]


SPEED = "omega"
SEGMENTS = {
    RISE: "rise",
    FAR_DWELL: "far dwell",
    RETURN: "return",
    NEAR_DWELL: "near dwell",
}
WHERE = {segment: f"in the {name}" for segment, name in SEGMENTS.items()}


@dataclass(frozen=True)
class FrameSymbols(Motion):
    """The frame at one instant, as loads read it: X, X', X'' are symbols; segment, worst: data."""

    phi: Number
    segment: int
    worst: int
    q: Number
    q1: Number
    q2: Number
    lowered: Number
    u: Number
    omega: Number
    omega_dot: Number = None

    @property
    def direction(self) -> Number:
        """Sign of X', `worst` in the dwells."""
        return {RISE: 1, RETURN: -1}.get(self.segment, self.worst)

    def contact(self, follower: Follower) -> SimpleNamespace:
        """Roller and cam by the pressure angle, and the outward normal n."""
        sp, angle = sympy(), symbol("pressure_angle")
        toward = Vector(-symbol("n_x"), -symbol("n_y"))
        swing = symbol("phi'")
        return SimpleNamespace(
            sides=(sp.cos(angle), -sp.sin(angle)),
            speed=sp.Integer(1),  # sides are shares of it
            normal=lambda theta: toward,
            phi_1=swing,
            rolling=sp.Symbol("w", positive=True) / follower.roller_radius - (1 + swing),
        )


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Equations of a shedding scene: law, segments, motion, terms, balance, contact, follower, coils.

    An effect that is not in the scene leaves no symbol and no term. phi0: the arm's angle at the beginning of the
    rise; omega: speed of the cam shaft; w: |d(x, y)/d theta|.
    """
    known, cam = _given(model), frame(model)
    if isinstance(cam, CamProgram):
        laws = dict.fromkeys(move.law for move in cam.moves if move.law)
        moved = [*(formula for cam_law in laws for formula in law(cam_law)), *program(cam, known)]
    else:
        moved = [*law(cam.law), *motion(cam, known)]
    equation_list = [*moved, *_forces(model, known)]
    if model.has_quantity("curvature"):
        equation_list += follower()
    pose = _pose(model, cam.segments[0], LEAST)
    equation_list += [
        formula for check in model.checks for formula in effect_equations.check_equations(check, pose, known)
    ]
    return (*equation_list, *effect_equations.joint_equations(model, pose, known, symbol("N"), "N"))


def _given(model: JobModel) -> Given:
    """Scene's numbers as symbols, with the words that choose formulas."""
    knots = set(filter(of_knots, model.known))
    values = {name: symbol(name) for name in model.known - knots - set(model.labels)}
    values |= {"speed": symbol(SPEED)} if "speed" in values else {}
    cam = frame(model)
    if isinstance(cam, CamProgram):
        letters = {"a": width, "X": height}
        named = {
            name(k): symbol(f"{letter}_{k + 1}") for k in range(len(cam.moves)) for letter, name in letters.items()
        }
        values |= named
        return effect_equations.given(model, {**values, **cam.derived(systems.sympy(), Given(values, {}), ())})
    far = values["rise"]
    turning = far + values["far_dwell"]
    values |= {"begin.far": far, "begin.return": turning, "begin.near": turning + values["return"]}
    return effect_equations.given(model, values)


def _pose(model: JobModel, segment: int, worst: int) -> FrameSymbols:
    X, X1, X2 = (symbol(name) for name in ("X", "X'", "X''"))
    lowered, u = X / symbol("travel"), symbol("u")
    pose = FrameSymbols(symbol("theta"), segment, worst, X, X1, X2, lowered, u, symbol(SPEED))
    return effect_equations.turning(pose, model)


def _forces(model: JobModel, known: Given) -> list[Equation]:
    """Write each term, their balance, the torque on the cam, and contact."""
    segments = frame(model).segments
    equations = [_term(model, segments, load, known) for load in model.loads]
    pose = _pose(model, segments[0], LEAST)
    equations += sums(model.loads, pose, symbol("N"), "N", torque=("cam torque", "cam_torque"))
    equations += effect_equations.crank_motion(model, pose, known, "cam_torque")
    checked = [WHERE[s] for s in segments if (SEGMENT, float(s)) in model.known_in]
    where = " and ".join(checked) if checked else "for every theta"
    equations.append(relation("contact", symbol("N"), ">=", symbol("N_min"), where))
    moves = _pose(model, RISE, LEAST), _pose(model, RETURN, LEAST)
    return equations + effect_equations.event_equations(model, moves, known, "N")


def _term(model: JobModel, segments: Sequence[int], load: Acting, known: Given) -> Equation:
    """Write a load's term by its own formula: by segments where that differs, else as any load's."""

    def force(segment: int, worst: int = LEAST) -> Expression:
        return effect_equations.force(load, _pose(model, segment, worst), known, 0)

    if len({force(segment) for segment in segments}) > 1:
        rows = [_in_segment(model, load, segment, force) for segment in segments]
        return cases(load.name, symbol(f"N_{load.name}"), rows)
    return effect_equations.term(load, _pose(model, segments[0], LEAST), known, "N")


def _in_segment(model: JobModel, load: Acting, segment: int, force: Callable[..., Expression]) -> Case:
    """Term in one segment, with the segment; a term that is unknown there is a text."""
    known_in = load.known_in(model.words_of(load.name)) if isinstance(load, Load) else ()
    if known_in and (SEGMENT, float(segment)) not in known_in:
        return "not known", WHERE[segment]
    least, most = force(segment), force(segment, MOST)
    if least != most:
        return f"any value of {text(least)} ... {text(most)} ({text(least)} for contact)", WHERE[segment]
    return least, WHERE[segment]


def motion(cam: CamFrame, given: Given) -> list[Equation]:
    """Segments, and u, X, X' and X'' in each, by the frame's own pose; given: the scene's numbers."""
    theta, values, pi = symbol("theta"), given.values, systems.sympy().pi
    ends = (sympy().Integer(0), *(values[f"begin.{name}"] for name in ("far", "return", "near")), 2 * pi)
    spans = [(SEGMENTS[k], (ends[k], theta, ends[k + 1])) for k in cam.segments]
    poses = {WHERE[k]: pose(cam, given, k) for k in cam.segments}
    named = (("argument of the law", "u"), ("travel", "X"), ("travel", "X'"), ("travel", "X''"))
    read: tuple[Callable[[FrameMotion], Number], ...] = (
        lambda at: at.u,
        lambda at: at.q,
        lambda at: at.q1,
        lambda at: at.q2,
    )
    return [
        cases("segments", symbol("segment"), spans),
        *(
            cases(kind, symbol(name), [(of(at), where) for where, at in poses.items()])
            for (kind, name), of in zip(named, read, strict=True)
        ),
    ]


def program(cam: CamProgram, given: Given) -> list[Equation]:
    """Segments of a motion in several, and u, X, X' and X'' in each; a_k: angle, X_k: X at its end."""
    theta, values, pi = symbol("theta"), given.values, systems.sympy().pi
    count = len(cam.moves)
    ends = [*(sympy().sympify(values[f"begin.{k + 1}"]) for k in range(count)), 2 * pi]
    unwritten = dataclasses.replace(
        cam, moves=tuple(move._replace(law=Unwritten(move.law)) if move.law else move for move in cam.moves)
    )
    first = {k: place for place, (k, _) in reversed(list(enumerate(cam.stretches)))}
    poses = [unwritten.pose(systems.sympy(), given, Node(theta, {SEGMENT: first[k]})) for k in range(count)]
    names = [f"in segment {k + 1}, a {MOVES[move.kind]}" for k, move in enumerate(cam.moves)]
    read: dict[str, Callable[[FrameMotion], Number]] = {
        "u": lambda at: at.u,
        "X": lambda at: at.q,
        "X'": lambda at: at.q1,
        "X''": lambda at: at.q2,
    }
    spans = [(name.removeprefix("in "), (ends[k], theta, ends[k + 1])) for k, name in enumerate(names)]
    return [
        cases("segments", symbol("segment"), spans),
        *(
            cases("travel", symbol(to), [(of(at), name) for at, name in zip(poses, names, strict=True)])
            for to, of in read.items()
        ),
    ]


def pose(cam: CamFrame, given: Given, segment: int) -> FrameMotion:
    """Frame's pose on symbols in a segment; the law's s, s', s'' are symbols."""
    unwritten = dataclasses.replace(cam, law=Unwritten(cam.law))
    return unwritten.pose(systems.sympy(), given, Node(symbol("theta"), {SEGMENT: segment, LAW: 0}))


class _Started(Follower):
    """A follower whose angle φ0 is a symbol."""

    def start_angle(self, maths: Maths) -> Number:
        """φ0."""
        return symbol("phi0")


def follower() -> list[Equation]:
    """Follower's equations: swing, roller centre, pressure angle, curvature, profile."""
    system, theta = systems.sympy(), symbol("theta")
    numbers = [symbol(name) for name in FOLLOWER]
    at = Contact(system, _Started(*numbers), symbol("phi"), symbol("phi'"), symbol("phi''"))
    speed = sympy().Symbol("w", positive=True)
    swing = symbol("arm_swing") / symbol("travel")

    def short(value: Expression) -> Expression:
        return sympy().sympify(value).subs(at.speed**2, speed**2)

    centre, profile = at.centre(theta), at.profile(theta)
    return [
        equation("follower", symbol("phi0"), Follower(*numbers).start_angle(system)),
        *(equation("follower", symbol(f"phi{p}"), swing * symbol(f"X{p}")) for p in ("", "'", "''")),
        equation("roller centre", symbol("x"), centre.x),
        equation("roller centre", symbol("y"), centre.y),
        equation("roller centre", speed, at.speed),
        equation("pressure angle", symbol("pressure_angle"), at.pressure_angle),
        equation("curvature of the roller centre's curve", symbol("curvature"), short(at.curvature)),
        equation("profile", symbol("x_p"), symbol("x") + short(profile.x - centre.x)),
        equation("profile", symbol("y_p"), symbol("y") + short(profile.y - centre.y)),
        equation("profile", symbol("profile_curvature"), _profile_curvature(numbers)),
    ]


def _profile_curvature(numbers: Sequence[Expression]) -> Expression:
    """Run the profile's curvature on that of the roller centre's curve."""

    class Bent(Contact):
        curvature = symbol("curvature")

    return Bent(systems.sympy(), Follower(*numbers), 0, 0, 0).profile_curvature


if TYPE_CHECKING:
    from loomopt.model.separation import Parted
    from loomopt.picture.equations import Equation
    from loomopt.picture.motion import MechanismMotion
    from loomopt.picture.shapes import Drawing, Floats

ALIKE = 1e-9
"""Forces this close, relative, in N, are one."""
FLOATS, NARROW = 1e-3, math.radians(5.0)
"""Share of the spring's largest force that holds no roller; rad: a narrower stretch is where the force touches zero."""


class SheddingViews(JobViews):
    """The cam with its follower, its equations, forces on the frame, and remarks."""

    angle = "cam angle"
    lists = {"law": "s'' at {count} knots"}  # noqa: RUF012 (never changed)

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> "Drawing":
        """Cam with its follower in both dwells and at the least cam force, full scale. Raises BadInput."""
        from loomopt.jobs.shedding import drawing

        cam = drawing.cam(scene, design)
        return drawing.linkage(scene, cam, registry.of(scene).figures(scene, design))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Profile as CSV. Raises BadInput."""
        from loomopt.jobs.shedding import drawing

        return drawing.joints_csv(scene, drawing.cam(scene, design))

    def motion(self, scene: Scene, design: Mapping[str, float], angles: "Floats") -> "MechanismMotion | None":
        """Cam turning under its arm at cam angles, rad; none without a follower. Raises BadInput."""
        from loomopt.jobs.shedding import drawing

        return None if self.missing(scene) else drawing.motion(drawing.cam(scene, design), angles)

    def missing(self, scene: Scene) -> tuple[str, ...]:
        """Keys of the follower that the scene does not give."""
        from loomopt.jobs.shedding import drawing

        return drawing.missing(scene)

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Equations the scene really uses."""

        return equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Dwells, cam angles in rad, and where the cam force is least if the frame stays on its cam."""
        job = registry.of(scene)
        values = job.sampler(scene, design).given.values
        spans = frame(job.model(scene)).spans(values)
        dwells = {name: Span(begin, end % TURN) for name, (begin, end) in spans.items() if "dwell" in name}
        angles: dict[str, float | Span] = {**dwells}
        parted = job.parted(scene, job.sampler(scene, design))
        if parted is None or not parted.course.parted:
            angle = job.figures(scene, design)["contact_angle"]
            angles["least cam force"] = math.nan if angle is None else angle
        if parted is None:
            return angles

        from loomopt.picture.parted import marks

        return marks(parted, angles)

    def words(self) -> Mapping[str, Curve]:
        """Names of the curves."""
        return {
            "X": Curve("frame travel"),
            "X_cam": Curve("cam"),
            "gap": Curve("frame to cam", most="gap_max"),
            "X_1": Curve("frame speed"),
            "X_2": Curve("frame acceleration"),
            "X_3": Curve(shown=False),
            "s_2": Curve("acceleration s'' of the cam law", peak="law_acceleration"),
            "N": Curve("cam force", least="contact_min", most="contact_max", wide=True),
            "return_spring": Curve(panel=BY_EFFECT),
            "cam_torque": Curve(peak="peak_torque"),
            "pressure_angle": Curve(peak="pressure_angle_max"),
            "curvature": Curve("pitch", least="curvature_min", most="curvature_max"),
            "profile_curvature": Curve(shown=False),
        }

    def panels(self, scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
        """All panels, with the lines that contact and the roller demand."""
        values = registry.of(scene).numbers_of(scene, design)
        levels = {"N [N]": {"contact is lost below N_min =": (values["N_min"],)}}
        if "roller_radius" in values:
            levels["curvature [1/m]"] = {"undercut above 1/roller_radius =": (1 / values["roller_radius"],)}
        panels = super().panels(scene, design, columns)
        # The law's own acceleration has the frame's shape: it says more only where it is limited. There is no torque in
        # the dwells, and where forces are known in them alone, none is known.
        partly = bool(registry.of(scene).model(scene).known_in)
        left = {"s_2 [1]": "law_acceleration" not in scene.limits, "cam_torque [N*m]": partly, POWER: partly}
        shown = [panel for panel in panels if not left.get(panel.columns[0])]
        shown = [panel._replace(levels={**panel.levels, **levels.get(panel.columns[0], {})}) for panel in shown]
        if "X_cam [m]" not in columns:
            return tuple(shown)
        from loomopt.picture.parted import together

        return together(shown, ("X [m]", "X_cam [m]"), "travel of frame and cam")

    def remarks(self, scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
        """Remarks: on forces that are known in the dwells only, a roller that floats, an undercut."""
        job = registry.of(scene)
        sampler = job.sampler(scene, design)
        undercut = () if self.missing(scene) else _undercut(scene, design)
        parted = _parted(scene, job.parted(scene, sampler))
        law = [record.summary for record in job.tables(scene, "") if record.key == LAW_TABLE]
        return (
            *law,
            *super().remarks(scene, design),
            *_partly(sampler),
            *_floating(scene, sampler),
            *undercut,
            *parted,
        )


def _parted(scene: Scene, parted: "Parted | None") -> Iterator[str]:
    """Remark on where the roller leaves the cam, where an effect models the frame's flight."""
    if parted:
        from loomopt.picture.parted import remarks

        yield from remarks(scene, parted)


def _floating(scene: Scene, sampler: Sampler) -> Iterator[str]:
    """Remark on cam angles at which nothing holds the roller on the cam, where no least force is demanded."""
    if scene.operation["N_min"] > 0.0:
        return
    spans = near_zero(sampler, "lift", FLOATS * abs(sampler.static["spring_force_max"]), NARROW)
    if spans:
        text = " and ".join(f"from {scene.show(a, 'angle', 4)} to {scene.show(b, 'angle', 4)}" for a, b in spans)
        whole = scene.show(sum(end - begin for begin, end in spans), "angle", 3)
        yield (
            f"N_min is 0, and the cam force is less than {100 * FLOATS:g} % of the spring's largest force {text}: the "
            f"roller floats for {whole} of the turn. What helps: an N_min above 0"
        )


def _undercut(scene: Scene, design: Mapping[str, float]) -> Iterator[str]:
    from loomopt.jobs.shedding import drawing

    cam = drawing.cam(scene, design)
    if cam.undercut:
        roller, radius = cam.follower.roller_radius, 1 / cam.undercut.value
        angle, most = scene.show(cam.sampler.angle(cam.undercut), "angle", 5), scene.show(radius, "length", 4)
        yield (
            f"the cam is undercut at {angle}: the roller's centre turns there with a radius of {most}, "
            f"{scene.show(roller - radius, 'length', 3)} less than roller_radius = {scene.show(roller, 'length')}, so "
            f"the profile is cut away and X not followed. What helps: a roller_radius below {most}, or a larger "
            f"base_radius"
        )


def _partly(sampler: Sampler) -> Iterator[str]:
    """Remark on loads that are known in the dwells only, and on the arcs on which contact is not checked."""
    acting = " and ".join(_acting(sampler)) if sampler.model.known_in else ""
    for load in sampler.model.loads:
        words = sampler.model.words_of(load.name)
        if acting and isinstance(load, Load) and load.known_in(words):
            shape = " and ".join(f"{key} {word}" for key, word in words.items())
            verb = "act" if " and " in acting else "acts"
            yield (
                f"{load.name} with {shape} is known in the dwells only: contact is judged there, and not in the moves, "
                f"where {acting} {verb}. Choose {_known_choices(load, words)} to judge the whole cycle"
            )


def _known_choices(load: Load[Any], words: Mapping[str, str]) -> str:
    """Words of a load's table with which it is known all over the cycle."""
    clauses = []
    for key, word in words.items():
        choices = [choice for choice in get_args(load.table.model_fields[key].annotation) if choice != word]
        clauses.append(
            f"{key} = " + " or ".join(f'"{choice}"' for choice in choices if not load.known_in({**words, key: choice}))
        )
    return " and ".join(clauses)


def _acting(sampler: Sampler) -> list[str]:
    """Loads that act while the frame moves: they need the speed, or differ between rise and return."""
    rise, back = (_terms(sampler, segment) for segment in (RISE, RETURN))
    moved = {load.name for load in sampler.model.loads if "operation.speed" in load.needs}
    moved |= {name for name, term in rise.items() if not math.isclose(term, back[name], rel_tol=ALIKE, abs_tol=ALIKE)}
    return [load.name for load in sampler.model.loads if load.name in moved]


def _terms(sampler: Sampler, segment: int) -> dict[str, Number]:
    """Term of each load a quarter of the way into a move, on the law's first formula."""
    values = sampler.given.values
    begin, share, length = {RISE: (0, 1, "rise"), RETURN: (values["begin.near"], -1, "return")}[segment]
    node = Node(begin + share * values[length] / 4, {SEGMENT: segment, LAW: 0.0})
    return sampler.model.instant(FLOAT, sampler.given, node).terms()


VIEWS = SheddingViews()
