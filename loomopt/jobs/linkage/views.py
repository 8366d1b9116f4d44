"""Views of the linkage; the modules that draw and print are imported at their first use.

In its equations each link's angle is a symbol of its own name, its derivatives with respect to φ have primes; a part
that slides has the place along its guide under its own name.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.linkage.model import LinkageMotion, Output, end_of_rest, event_value, linkage_of
from loomopt.jobs.linkage.scene import ambiguity, read_tables
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Number
from loomopt.model.model import JobModel
from loomopt.model.numbers import table_remarks
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import Effect
from loomopt.physics.mechanisms import chain
from loomopt.physics.mechanisms.assur_groups import Slide
from loomopt.physics.mechanisms.chain import FRAME_NAME, Chain, Part
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.moving import Joint, Link, total
from loomopt.physics.schema import Values
from loomopt.picture import effect_equations
from loomopt.picture.equations import Angle, Equation, Expression, Symbols, equation, loop, moving, symbol, sympy
from loomopt.picture.job_views import LinkViews, Marks, Span
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.sampling import Sampler
    from loomopt.picture.mechanism_drawing import MechanismDrawing
    from loomopt.picture.panels import Curve

LITERAL, FINEST = 1e-14, 720
"""Relative error up to which a literal is shown as a fraction, and largest denominator of a fraction of pi."""


@dataclass
class _SymbolicParts:
    """Loop equations of the parts as symbols, in order.

    pose: joints and links whose angles are symbols; taken: names of numbers; angles: those that move, by name.
    """

    pose: chain.ChainPose
    taken: Collection[str] = ()
    angles: dict[str, Angle] = field(default_factory=dict)
    equations: list[Equation] = field(default_factory=list)

    def angle(self, name: str) -> str:
        """Symbol of the angle of a link, or of the position of a slider; it differs from the names of all numbers."""
        return f"theta_{name}" if name in self.taken else name

    def link(self, name: str, origin: Joint, angle: Angle) -> Link:
        """Add a link with an angle."""
        sp = sympy()
        self.angles[name] = angle
        rates = (None, angle.rate, angle.second, symbol(f"{angle.name}'''"))
        unit = Vector(sp.cos(angle.symbol), sp.sin(angle.symbol))
        link = Link(origin, lambda: unit, lambda order: rates[order] if rates[order] != 0 else None)
        self.pose.links[name] = link
        return link

    def pin(self, part: Part, link: Link, key: str) -> None:
        """Add the pin at the end of a link whose length is a number of the part."""
        if part.word("pin"):
            self.pose.joints[part.word("pin")] = link.point(self.pose.number(part, key))

    def close(self, part: Part, sides: Iterable[tuple[Expression, Expression]], unknown: list[str]) -> None:
        """Write a loop's closure with its derivatives."""
        sp = sympy()
        pairs = [(sp.sympify(left), sp.sympify(right)) for left, right in sides]
        symbols = {free for pair in pairs for side in pair for free in side.free_symbols}
        known = [angle for name, angle in self.angles.items() if name not in unknown and angle.symbol in symbols]
        self.equations += loop(pairs, symbol("phi"), [self.angles[name] for name in unknown], known, f"{part.name}: ")


def symbolic(linked: Chain, taken: Collection[str] = ()) -> _SymbolicParts:
    """Parts as symbols, and their loop equations; taken: names of numbers, which angles must not have."""
    exact = replace(systems.sympy(), number=_exact)
    written = _SymbolicParts(chain.ChainPose(exact, Symbols(), symbol("phi")), taken)
    for part in linked.parts:
        WRITTEN.get(part.kind, _placed)(written, part)
    return written


def _exact(value: float) -> Expression:
    """Literal as a person would write it: a fraction, or one of pi."""
    sp = sympy()
    turned = sp.nsimplify(value / math.pi, rational=True, tolerance=LITERAL)
    return turned * sp.pi if turned.q <= FINEST else sp.nsimplify(value, rational=True, tolerance=LITERAL)


def _placed(written: _SymbolicParts, part: Part) -> None:
    """Run the part's own formula."""
    written.pose.place(part)


def _crank(written: _SymbolicParts, part: Part) -> None:
    start = written.pose.number(part, "start")
    turned = part.ratio * symbol("phi")
    angle = Angle(written.angle(part.name), sympy().Integer(part.ratio), sympy().Integer(0))
    link = written.link(part.name, written.pose.joints[part.word("at")], angle)
    written.equations.append(equation(f"{part.name}: crank", angle.symbol, total(turned, start)))
    written.pin(part, link, "length")


def _gear(written: _SymbolicParts, part: Part) -> None:
    sp, pose = sympy(), written.pose
    mate, carrier = symbol(written.angle(part.word("with"))), part.word("carrier")
    ratio, zero, start = sp.nsimplify(part.ratio), pose.number(part, "zero"), pose.number(part, "start")
    right = ratio * (mate if zero is None else mate - zero)
    if carrier and carrier != FRAME_NAME:
        right += (1 - ratio) * symbol(written.angle(carrier))
    link = written.link(part.name, pose.joints[part.word("at")], moving(written.angle(part.name)))
    written.equations.append(
        equation(f"{part.name}: gear", symbol(written.angle(part.name)), right if start is None else right + start)
    )
    written.pin(part, link, "length")


def _cam(written: _SymbolicParts, part: Part) -> None:
    pose, sp = written.pose, sympy()
    lift, start = pose.number(part, "lift"), pose.number(part, "start")
    law = sp.Function(f"s_{part.word('law') or part.name}")(symbol("phi"))
    risen = law if lift is None else lift * law
    link = written.link(part.name, pose.joints[part.word("at")], moving(written.angle(part.name)))
    written.equations.append(
        equation(f"{part.name}: cam", symbol(written.angle(part.name)), risen if start is None else risen + start)
    )
    written.pin(part, link, "length")


def _dyad(written: _SymbolicParts, part: Part) -> None:
    pose, names = written.pose, part.names("links")
    ends = [pose.joints[joint] for joint in part.names("joins")]
    links = [written.link(name, end, moving(written.angle(name))) for name, end in zip(names, ends, strict=True)]
    reached = [link.point(pose.number(part, name)).place for link, name in zip(links, names, strict=True)]
    written.close(part, zip(*reached, strict=True), list(names))
    written.pin(part, links[1], names[1])


def _guide(written: _SymbolicParts, part: Part) -> Vector:
    """Direction of a slider's guide."""
    sp, guide, tilt = sympy(), part.word("guide"), written.pose.number(part, "direction")
    angle = sp.Integer(0) if tilt is None else tilt
    if guide and guide != FRAME_NAME:
        angle = angle + symbol(written.angle(guide))
    return Vector(sp.cos(angle), sp.sin(angle))


def _slider(written: _SymbolicParts, part: Part) -> None:
    pose, (name,) = written.pose, part.names("links")
    link = written.link(name, pose.joints[part.word("from")], moving(written.angle(name)))
    written.angles[part.name] = moving(written.angle(part.name))
    at, d, s = pose.joints[part.word("through")].place, _guide(written, part), symbol(written.angle(part.name))
    e = pose.number(part, "offset")
    along = Vector(at.x + s * d.x, at.y + s * d.y)
    reached = along if e is None else Vector(along.x - e * d.y, along.y + e * d.x)
    tip = link.point(pose.number(part, name)).place
    written.close(part, zip(tip, reached, strict=True), [name, part.name])
    pose.slides[part.name] = Slide(lambda order: symbol(written.angle(part.name) + "'" * order))
    written.pin(part, link, name)


def _slot(written: _SymbolicParts, part: Part) -> None:
    pose, name = written.pose, part.word("link")
    link = written.link(name, pose.joints[part.word("at")], moving(written.angle(name)))
    written.angles[part.name] = moving(written.angle(part.name))
    reached = link.point(symbol(written.angle(part.name)), pose.number(part, "offset")).place
    through = pose.joints[part.word("through")].place
    written.close(part, zip(reached, through, strict=True), [name, part.name])
    pose.slides[part.name] = Slide(lambda order: symbol(written.angle(part.name) + "'" * order))
    written.pin(part, link, "length")


WRITTEN = {"crank": _crank, "gear": _gear, "cam": _cam, "dyad": _dyad, "slider": _slider, "slot": _slot}
"""Method that writes each kind of part; the other kinds have their own formula."""


class SymbolicPose(LinkageMotion):
    """The linkage as symbols, its output q with primes."""

    def order(self, order: int) -> Number:
        """q, or a derivative of it."""
        return symbol("q" + "'" * order)

    def travelled(self, given: Values, event: str) -> Number:
        """q less its value at an event."""
        return symbol("q") - symbol(f"q_{event}")


def _output(out: Output, written: _SymbolicParts) -> Expression:
    """Equation of the output."""
    if out.measure in ("x", "y"):
        expression = getattr(written.pose.joints[out.name].place, out.measure)
    else:
        expression = symbol(written.angle(out.name)) - (symbol(written.angle(out.against)) if out.against else 0)
    if out.scale is not None:
        expression = (symbol(out.scale.name) if out.scale.name else _exact(out.scale.value)) * expression
    return expression if out.sign > 0 else -expression


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Equations of a linkage scene: how its parts close, the output, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term; numbers of a named effect have its name as index.
    """
    linkage = linkage_of(model)
    out, written = linkage.output, symbolic(linkage.chain, model.known)
    at = SymbolicPose(written.pose, out, symbol("omega"))
    effect_symbols = {
        f"{effect.name}.{key}": _effect_value(effect, key)
        for effect in model.effects
        for key in effect.table.model_fields
    }
    numbers = Symbols({name: index_symbol for name, index_symbol in effect_symbols.items() if name in model.known})
    numbers |= {event_value(place.name): symbol(f"phi_{place.name}") for place in linkage.places}
    known = Given(numbers, {effect.name: _effect_values(model, effect) for effect in model.effects})
    letter = "F" if out.slides else "M"
    kinematics = (*written.equations, equation("output", symbol("q"), _output(out, written)))
    return (*kinematics, *effect_equations.forces(model, at, known, "Q", letter))


def _effect_value(effect: Effect, key: str) -> Expression:
    """Symbol of a number of an effect's table; of a named one with its name as index."""
    letter = effect.letters.get(key, key)
    return symbol(f"{letter}_{effect.instance}" if effect.instance else letter)


def _effect_values(model: JobModel, effect: Effect) -> Values:
    """Symbols and words of an effect's table, of those keys that are given."""
    given = {
        key: _effect_value(effect, key) for key in effect.table.model_fields if f"{effect.name}.{key}" in model.known
    }
    words = model.words_of(effect.name)
    return {**given, **words, **({"instance": effect.instance} if effect.instance else {})}


class LinkageViews(LinkViews):
    """The linkage at its events, its equations, and where its windows lie."""

    def drawn(self, scene: Scene, design: Mapping[str, float]) -> "MechanismDrawing":
        """Linkage at its events. Raises BadInput."""
        from loomopt.jobs.linkage.drawing import LinkageDrawing

        return LinkageDrawing(self.sampler(scene, design))

    def sampler(self, scene: Scene, design: Mapping[str, float]) -> "Sampler":
        """Samples of a design."""
        return registry.of(scene).sampler(scene, design)

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        """Equations the scene really uses."""
        return equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Crank angles of the events, rad, and where the windows lie."""
        sampler = registry.of(scene).sampler(scene, design)
        model, given = sampler.model, sampler.given
        marks: dict[str, float | Span] = {
            name: float(angle) % TURN for name, angle in model.kinematics.events(FLOAT, given).items()
        }
        for arc in model.arcs:
            begin, end = (float(angle) for angle in arc.corners(FLOAT, given))
            marks[arc.name.removeprefix("window ")] = Span(begin % TURN, begin % TURN + end - begin)
        return marks

    def words(self) -> "Mapping[str, Curve]":
        """Names of the curves."""
        from loomopt.picture.panels import Curve

        return {
            "q": Curve("output"),
            "q_1": Curve("velocity of the output", peak="peak_velocity"),
            "q_2": Curve("acceleration of the output", peak="peak_acceleration"),
            "q_3": Curve("jerk of the output", peak="peak_jerk"),
            "Q": Curve("load of the output"),
            "Md": Curve("crank torque", peak="peak_torque"),
        }

    def remarks(self, scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
        """Remarks: on the curves, and on events that lie elsewhere than today's."""
        remarks = (*table_remarks(scene), *_without_place(scene))
        moved = self._moved(scene, design)
        return (*remarks, *self._rests(scene, design), *self._ambiguous(scene), *((moved,) if moved else ()))

    def _ambiguous(self, scene: Scene) -> Iterator[str]:
        """Yield the sentence on each event that is one of several equal extremes of today's linkage."""
        given = registry.of(scene).sampler(scene, {}).given
        linkage = linkage_of(registry.of(scene).model(scene))
        for place in linkage.places:
            if place.extreme:
                turns = linkage.of(place).turns(given) if place.of else linkage.turns(given)
                text = ambiguity(scene, turns, place)
                if text:
                    yield f'{text}; add near = "60 deg" to events.{place.name}'

    def _rests(self, scene: Scene, design: Mapping[str, float]) -> Iterator[str]:
        """Yield for each event at which the output rests which end of the rest it is."""
        given = registry.of(scene).sampler(scene, design).given
        linkage = linkage_of(registry.of(scene).model(scene))
        for place in linkage.places:
            turn = linkage.turn(given, place) if place.extreme and linkage.chain.cams else None
            if turn is None or not turn.rests:
                continue
            begin, end = (scene.show(corner.angle % TURN, "angle", 5) for corner in turn.rest)
            standing = end_of_rest(turn, place)
            assert standing is not None
            yield f"{place.name} is where {linkage.corner_words(standing)}: the output rests from {begin} to {end}"

    def _moved(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Remark on a design with more or fewer reversals than today's: its events may differ."""
        job = registry.of(scene)
        here, today = job.sampler(scene, design), job.sampler(scene, {})
        linkage = linkage_of(here.model)
        if not any(place.extreme for place in linkage.places):
            return ""
        turns, before = (len(linkage.turns(sampler.given)) for sampler in (here, today))
        if turns == before:
            return ""
        where = ", ".join(
            f"{place.name} at {scene.show(float(here.given.values[place.value]) % TURN, 'angle', 5)}"
            for place in linkage.places
        )
        often = f"the output turns {turns} times in a turn of the crank, today's {before} times"
        return f"{often}; its events lie at {where}"


def _without_place(scene: Scene) -> Iterator[str]:
    """Remark on the output's mass that the joint forces, or the weight, do not include."""
    out, effects = read_tables(scene.document).linkage.output, scene.effects
    tellers = " and ".join(effect.of_masses for effect in scene.active if effect.of_masses)
    for name in ("inertia", "counterweight"):
        if not tellers or name not in effects:
            continue
        if out.carrier:
            if name == "inertia" and getattr(effects[name], "m", 0.0) is None:
                key = "effects.inertia.m and centre"
                yield f"left out of {tellers}: the mass of the output. effects.inertia gives J alone. Give {key}"
        else:
            yield (
                f"left out of {tellers}: the mass of effects.{name}, but for what it does to the output itself. The "
                f"motion of the output {out.measure} of {out.name} alone does not tell where the mass moves. Give it "
                "as effects.mass, on a link or a joint, instead"
            )


VIEWS = LinkageViews()
"""The one object that draws and writes."""
