"""Family: one machine for several sets of scene numbers, as one program with shared and separate variables.

Members are counted by index. A quantity that is the same for all members is in the program once, under its own name;
any other quantity once for each member. Each level minimises the worst of the members, or their sum.
"""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from typing import Literal, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.recording import Tape, recorded
from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Arcs, Group
from loomopt.model.limits import CycleLimit, DesignLimit, Limit, RatioLimit
from loomopt.model.model import CycleQuantity, DesignRow, Formula, Instant, Integral, JobModel, cornered
from loomopt.model.objectives import Objective, ObjectiveSense, Piece, Value, Worst
from loomopt.model.program import Alias, Move, Numbers, Program, Variable
from loomopt.model.reading import DATUM
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Node, Where
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Values
from loomopt.scenes.family import member_name, sum_name

Combine = Literal["worst", "sum"]
"""Combination of the members' figures that is minimised."""


def of_member(name: str, member: int) -> Alias:
    """Name of a member's number in the program of the family; members are counted from 1."""
    return Alias(member_name(name, member), name)


# One model, several sets of numbers.


class Scenario(NamedTuple):
    """Member: its model, and the names of its numbers and switches in the family."""

    model: JobModel
    values: Mapping[str, str]
    switches: Mapping[str, str]

    def given(self, maths: Maths, values: Values) -> Given:
        """Numbers of the member and those that follow from them, SI; values: numbers of the family."""
        return self.model.given(maths, {key: values[name] for key, name in self.values.items() if name in values})

    def node(self, node: Node) -> Node:
        """Node of the family as a node of the member."""
        switch = {key: node.switch[name] for key, name in self.switches.items() if name in node.switch}
        return Node(node.phi, switch | {name: node.switch[name] for name in (DATUM,) if name in node.switch})


def members_of(given: Given) -> tuple[Given, ...]:
    """Numbers of each member."""
    members = given.linkage
    assert isinstance(members, tuple)
    return members


@dataclass(frozen=True, eq=False)
class FamilyKinematics:
    """Motions of all members; events: member and name of each event of the family."""

    scenarios: tuple[Scenario, ...]
    structure: Hashable
    groups: Mapping[str, Group]
    occurring: Mapping[str, tuple[int, str]]
    arcs: tuple[Arcs, ...] = ()
    breaks: frozenset[str] = frozenset()

    def linkage(self, maths: Maths, values: Values) -> tuple[Given, ...]:
        """Numbers of each member."""
        return tuple(scenario.given(maths, values) for scenario in self.scenarios)

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """Empty: the members have them."""
        return {}

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """Approximate angles of the members' events without a closed form."""
        pairs = zip(self.scenarios, members_of(given), strict=True)
        return {part.values[name]: at for part, numbers in pairs for name, at in part.model.hints(numbers).items()}

    def pose(self, maths: Maths, given: Given, node: Node) -> Number:
        """Every member at a node; unread quantities are not computed."""
        pairs = zip(self.scenarios, members_of(given), strict=True)
        return tuple(part.model.instant(maths, numbers, part.node(node)) for part, numbers in pairs)

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> Number:
        """Every member at an event of one of them."""
        return self.pose(maths, given, Node(self.events(maths, given)[event], switch))

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Crank angles, rad, of members' events."""
        members = members_of(given)
        return {
            name: self.scenarios[k].model.event(maths, members[k], event) for name, (k, event) in self.occurring.items()
        }


def _quantity(member: int, name: str, at: Instant) -> Number:
    instant: Instant = at.pose[member]
    return instant.model.formula(name)(instant)


def _row(scenario: Scenario, member: int, name: str, event: str, at: Instant) -> Number:
    stills = {event: scenario.node(at.node).switch} if event else {}
    return scenario.model.static(at.maths, members_of(at.given)[member], stills, (name,))[name]


def _derived(member: int, name: str, at: Instant) -> Number:
    return members_of(at.given)[member].values[name]


def _beyond(formula: Formula, sign: float, least: str, at: Instant) -> Number:
    return sign * formula(at) - at.values[least]


def _sum(formulas: Sequence[Formula], at: Instant) -> Number:
    return total([formula(at) for formula in formulas])


def _number(name: str, at: Instant) -> Number:
    return at.values[name]


def _corners(scenario: Scenario, member: int, place: int, maths: Maths, given: Given) -> tuple[Number, ...]:
    return cornered(scenario.model, maths, members_of(given)[member])[place].angles


def _parting(scenario: Scenario, member: int, place: int, maths: Maths, given: Given) -> tuple[Number, ...]:
    return cornered(scenario.model, maths, members_of(given)[member])[place].placed


# Numbers that are the same for all members.


class Roots:
    """Numbers of a model on which its values depend; known: their names."""

    def __init__(self, model: JobModel, known: Collection[str]) -> None:
        self.model, self.tape = model, Tape()
        self.maths, self.there = (recorded(self.tape, system) for system in range(2))
        self.inputs = {name: self.tape.input() for name in sorted(known)}
        self._dependencies: dict[str, frozenset[str]] = {}

    @lazy
    def given(self) -> Given:
        """Recorded inputs for the numbers. Raises the error of a formula that cannot be recorded."""
        return self.model.given(self.maths, self.inputs)

    @lazy
    def switches(self) -> dict[str, Number]:
        """Recorded inputs for the switches of a node."""
        return {name: self.tape.input() for name in (*self.model.switches, DATUM)}

    def of(self, name: str) -> frozenset[str]:
        """Numbers on which a row, a whole-cycle quantity or a mean depends."""
        if name in self.inputs:
            return frozenset({name})
        if name not in self._dependencies:
            self._dependencies[name] = self._of(lambda: self._read(name))
        return self._dependencies[name]

    def of_switch(self, place: int) -> frozenset[str]:
        """Numbers on which the corners of a switch depend, by its index in the model."""
        return self._of(lambda: cornered(self.model, self.maths, self.given)[place].angles)

    def _read(self, name: str) -> tuple[Number, ...]:
        mean = next((mean for mean in self.model.integrals if name in (mean.name, mean.root)), None)
        if mean or self.model.has_quantity(name):
            node = Node(self.tape.input(), self.switches)
            value = self.model.quantity(self.there, self.given, mean.quantity if mean else name, node)
            # The pieces that a mean is taken over move with their corners.
            return (value, *(self.model.corners(self.maths, self.given) if mean and not mean.angles else ()))
        rows = self.model.static(self.maths, self.given, {}, (name,))
        return (rows[name] if name in rows else self.given.values[name],)

    def _of(self, read: Callable[[], tuple[Number, ...]]) -> frozenset[str]:
        try:
            outputs = read()
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            return frozenset(self.inputs)
        needed = self.tape.needed(outputs, len(self.tape.operations))
        turned = [place for place, name in enumerate(self.model.switches) if self.switches[name].place in needed]
        roots = frozenset(name for name, value in self.inputs.items() if value.place in needed)
        return roots.union(*(self.of_switch(place) for place in turned))


# Joint objectives.


@dataclass(frozen=True)
class WorstOf(Objective):
    """Minimum of the worst value over the members; of: the members' objectives."""

    _: KW_ONLY
    of: tuple[Objective, ...]

    @property
    def rows(self) -> tuple[str, ...]:
        """All rows and quantities of the members' objectives."""
        return tuple(row for objective in self.of for row in objective.rows)

    @property
    def sides(self) -> tuple[tuple[str, float], ...]:
        """Rows of the members' objectives, with their signs."""
        return tuple(side for objective in self.of for side in objective.sides)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantities of the members' objectives."""
        return tuple(name for objective in self.of for name in objective.quantities)

    @property
    def sense(self) -> ObjectiveSense:
        """Sense of the members' objectives: "least" or "most"."""
        return self.of[0].sense

    def worsening(self, now: float, then: float, most: bool) -> float:
        """Amount by which the figure becomes worse from now to then, SI."""
        return self.of[0].worsening(now, then, most)

    def pieces(self, sampler: Sampler) -> list[Piece]:
        """Smooth functions of the members' objectives."""
        return [piece for objective in self.of for piece in objective.pieces(sampler)]

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limits that keep every objective of the members at `most`, SI."""
        return [limit for objective in self.of for limit in objective.limits(name, most)]


class WorstMagnitude(WorstOf):
    """Minimum of the worst magnitude over the members."""

    is_magnitude, least = True, 0.0


# The members' programs as one.


class MemberShare(NamedTuple):
    """Part of a member in the family: its program, and the names of its variables and limits in the family.

    names: name in the family by variable; limits: name in the family by name of a limit that is not shared.
    """

    program: Program
    names: Mapping[str, str]
    limits: Mapping[str, str]

    def member_values(self, x: Numbers) -> dict[str, float]:
        """Variables of the member, SI, from those of the family."""
        return {name: x[whole] for name, whole in self.names.items()}

    def sampler(self, x: Numbers) -> Sampler:
        """Sampler of the member's design, from the variables of the family, SI."""
        return sampled(self.program.model, {**self.program.parameters, **self.member_values(x)})


class Family(NamedTuple):
    """Program of all members, and the part of each member."""

    program: Program
    parts: tuple[MemberShare, ...]


def standing_for(program: Program, name: str) -> frozenset[str]:
    """Variables of a program for a number of the design: itself, or the variables in its limits."""
    if any(variable.name == name for variable in program.variables):
        return frozenset({name})
    return frozenset(limit.row for limit in program.limits if limit.name == name and limit.is_of_variable)


def together(programs: Sequence[Program], separate: Collection[str], combine: Combine) -> Family:
    """Program of a family; separate: variables that each member has for itself.

    The programs of the members have the same structure and differ in numbers only.
    """
    if len(programs) == 1:
        names = {variable.name: variable.name for variable in programs[0].variables}
        return Family(programs[0], (MemberShare(programs[0], names, {}),))
    return _Combining(programs, separate, combine).family()


UNLIKE = 1e-3
"""Share of its bounds by which a variable of one member is moved from another's, to see what changes."""


class _Combining:
    """Builder of the program of a family from the programs of its members."""

    def __init__(self, programs: Sequence[Program], separate: Collection[str], combine: Combine) -> None:
        self.programs, self.combine = tuple(programs), combine
        self.first, self.model = programs[0], programs[0].model
        self.variables = [variable.name for variable in self.first.variables]
        self.hinted = self._hinted(separate)
        self.roots = Roots(self.model, [*self.first.parameters, *self.variables, *self.hinted])
        self.apart = self._apart(separate)
        self.rows: dict[str, DesignRow] = {}
        self.quantities: dict[str, CycleQuantity] = {}
        self.integrals: dict[str, Integral] = {}
        self.events: dict[str, tuple[int, str]] = {}
        self.extra: list[Variable] = []
        self.extra_limits: list[Limit] = []
        self.measured: dict[str, tuple[int, Objective]] = {}

    def _hinted(self, separate: Collection[str]) -> dict[str, bool]:
        """Events without a closed form, by name of value, and whether they differ between members.

        They are computed by iteration, at the first start with different separate variables for each member.
        """
        hints = list[Mapping[str, float]]()
        for k, program in enumerate(self.programs):
            start = dict(self.first.starts[0])
            for v in self.first.variables:
                if v.name in separate and math.isfinite(v.upper - v.lower):
                    start[v.name] += (k + 1) * UNLIKE * (v.upper - v.lower)
            try:
                hints.append(sampled(program.model, {**program.parameters, **program.completed(start)}).hints)
            except (ValueError, ArithmeticError):
                hints.append({})
        return {name: any(angles.get(name) != value for angles in hints) for name, value in hints[0].items()}

    def _apart(self, separate: Collection[str]) -> frozenset[str]:
        """Numbers that differ between members, and variables that an equality ties to them."""
        numbers = [program.parameters for program in self.programs]
        names = {*separate} | {name for name in numbers[0] if any(table[name] != numbers[0][name] for table in numbers)}
        names |= {name for name, moves in self.hinted.items() if moves}
        for same in zip(*(program.variables for program in self.programs), strict=True):
            names |= {same[0].name} if max(v.lower for v in same) > min(v.upper for v in same) else set()
        tied = [(limit.reads, limit.value) for limit in self.first.limits if limit.sign == 0]
        sides = [[limit.value for limit in program.limits if limit.sign == 0] for program in self.programs]
        while True:
            more = set[str]()
            for place, (reads, _) in enumerate(tied):
                read = frozenset[str]().union(*map(self.roots.of, reads))
                differs = any(values[place : place + 1] != sides[0][place : place + 1] for values in sides)
                if differs or read & names:
                    more |= {name for name in read if name in self.variables and name not in self.known}
            for name, quantity in self.first.tops.items():
                more |= {name} if self.roots.of(quantity) & names else set()
            if more <= names:
                return frozenset(names)
            names |= more

    @lazy
    def known(self) -> frozenset[str]:
        """Variables that a designer chooses: those with a bound among the limits, and fixed ones."""
        limited = {limit.row for limit in self.first.limits if limit.is_of_variable}
        return frozenset(limited | {v.name for v in self.first.variables if v.lower == v.upper})

    # Names.

    def name(self, member: int, name: str) -> str:
        """Name of a member's number in the family."""
        return of_member(name, member) if name in self.apart else name

    def is_shared(self, name: str) -> bool:
        """Whether a row or quantity is the same for all members."""
        return self.roots.of(name).isdisjoint(self.apart)

    def read(self, member: int, name: str) -> str:
        """Name of a member's row, quantity, mean or number in the family; it is added if it is missing."""
        if name in self.first.parameters or name in self.variables:
            return self.name(member, name)
        shared, model = self.is_shared(name), self.model
        called = name if shared else of_member(name, member)
        if called in self.rows or called in self.quantities or called in self.integrals:
            return called
        mean = next((mean for mean in self.programs[member].model.integrals if name in (mean.name, mean.root)), None)
        if mean:
            where = self.where(member, mean.where)
            whole = mean._replace(
                name=mean.name if shared else of_member(mean.name, member),
                root=mean.root if shared else of_member(mean.root, member),
                quantity=self.read(member, mean.quantity),
                where=where,
            )
            self.integrals[whole.name] = self.integrals[whole.root] = whole
        elif model.has_quantity(name):
            square = model.square(name)
            self.quantities[called] = CycleQuantity(
                functools.partial(_quantity, member, name),
                signed=name in model.signed,
                bounded=name in model.bounded,
                square=self.read(member, square) if square else "",
            )
        elif model.has_row(name):
            event = model.event_of(name)
            at = event and (event if shared else of_member(event, member))
            self.events |= {at: (member, event)} if at else {}
            formula = functools.partial(_row, self.scenarios[member], member, name, event)
            self.rows[called] = DesignRow(formula, event=at, loaded=False)
        else:
            self.rows[called] = DesignRow(functools.partial(_derived, member, name))
        return called

    def where(self, member: int, where: Where | None) -> Where | None:
        """Pieces of a member's cycle as pieces of the cycle of the family."""
        return where and (self.scenarios[member].switches[where[0]], where[1])

    # The model.

    @lazy
    def scenarios(self) -> tuple[Scenario, ...]:
        """The members by index."""
        names = [*self.first.parameters, *self.variables, *self.hinted]
        turning = {
            switch: bool(self.roots.of_switch(place) & self.apart) for place, switch in enumerate(self.model.switches)
        }
        return tuple(
            Scenario(
                program.model,
                {name: self.name(k, name) for name in names},
                {switch: of_member(switch, k) if apart else switch for switch, apart in turning.items()},
            )
            for k, program in enumerate(self.programs)
        )

    def arcs(self) -> list[tuple[bool, Arcs]]:
        """Switches of the family, and whether each of them changes a formula."""
        model, arcs = self.model, dict[str, tuple[bool, Arcs]]()
        loads = [load for load in model.loads if isinstance(load, Load) and load.corners]
        reads = [arc.switch for arc in (*model.kinematics.arcs, *model.arcs)] + [load.switch for load in loads]
        for k, scenario in enumerate(self.scenarios):
            for place, (key, switch) in enumerate(zip(model.switches, reads, strict=True)):
                if (name := scenario.switches[key]) not in arcs:
                    corners, parting = (functools.partial(of, scenario, k, place) for of in (_corners, _parting))
                    arcs[name] = key in model.formula_switches, Arcs(name, corners, switch, parting=parting)
        return list(arcs.values())

    def closing(self) -> tuple[dict[str, Group], dict[str, tuple[str, float]]]:
        """Rows that must be satisfied for assembly: those of groups of links, and the others."""
        closes, conditions = dict[str, str](), dict[str, tuple[str, float]]()
        groups = self.model.kinematics.groups
        for k in range(len(self.programs)):
            for prefix, group in groups.items():
                for phrase, name in group.closes.items():
                    read = self.read(k, prefix + name)
                    closes[phrase if read == prefix + name else of_member(phrase, k)] = read
            for phrase, (name, most) in self.model.assembled.items():
                read = self.read(k, name)
                conditions[phrase if read == name else of_member(phrase, k)] = read, most
        angles = [group.closest for group in groups.values()]
        closest = tuple(dict.fromkeys(angle for names in angles for angle in names)) if all(angles) else ()
        return {"": Group({}, closes, closest=closest)}, conditions

    def whole(self) -> JobModel:
        """Model of all members, with the rows and quantities that have been read."""
        groups, conditions = self.closing()
        arcs = self.arcs()
        scenarios = tuple(
            (part.model.key, tuple(part.values.items()), tuple(part.switches.items())) for part in self.scenarios
        )
        motion = FamilyKinematics(
            self.scenarios,
            ("family", scenarios),
            groups,
            dict(self.events),
            tuple(arc for changes, arc in arcs if changes),
        )
        return JobModel(
            motion,
            own_quantities=dict(self.quantities),
            own_rows=dict(self.rows),
            arcs=tuple(arc for changes, arc in arcs if not changes),
            integrals=tuple({mean.name: mean for mean in self.integrals.values()}.values()),
            assembled=conditions,
        )

    # Variables, limits, objectives.

    def variable(self, member: int, place: int) -> Variable:
        """Variable of a member as a variable of the family."""
        variables = [program.variables[place] for program in self.programs]
        variable = variables[member]
        if variable.name in self.apart:
            return variable._replace(name=of_member(variable.name, member), label=of_member(variable.called, member))
        lower, upper = max(v.lower for v in variables), min(v.upper for v in variables)
        return variable._replace(lower=lower, upper=max(lower, upper))

    def limit(self, member: int, limit: Limit) -> Limit:
        """Limit of a member as a limit of the family."""
        whole: Limit = replace(limit, row=self.read(member, limit.row))
        if isinstance(whole, RatioLimit):
            whole = replace(whole, weight=self.read(member, whole.weight))
        if isinstance(whole, CycleLimit):
            whole = replace(whole, where=self.where(member, whole.where))
        same = whole.reads == limit.reads and getattr(whole, "where", None) == getattr(limit, "where", None)
        return whole if same else replace(whole, name=of_member(limit.name, member))

    def limits(self) -> list[Limit]:
        """Limits of all members, those that are the same once."""
        limits: dict[Hashable, Limit] = {}
        for k, program in enumerate(self.programs):
            for limit in program.limits:
                whole = self.limit(k, limit)
                limits.setdefault(replace(whole, scale=1.0), whole)
        return list(limits.values())

    def objective(self, member: int, objective: Objective) -> Objective:
        """Objective of a member as a part of the family's objective."""
        whole = replace(objective, row=self.read(member, objective.row))
        if isinstance(whole, Worst):
            whole = replace(whole, others=tuple(self.read(member, row) for row in whole.others))
        return whole

    def objectives(self) -> tuple[Objective, ...]:
        """Levels of the family: the worst or the sum of each level of the members.

        For a magnitude the sum over the members is minimised next.
        """
        levels: list[Objective] = []
        for level in zip(*(program.objectives for program in self.programs), strict=True):
            objectives = [self.objective(k, objective) for k, objective in enumerate(level)]
            scale = max(objective.scale for objective in objectives)
            objectives = [replace(objective, scale=scale) for objective in objectives]
            first = objectives[0]
            if all(objective == first for objective in objectives):
                levels.append(first)
                continue
            if self.combine == "worst":
                kind = WorstMagnitude if first.is_magnitude else WorstOf
                levels.append(kind(first.figure, first.row, scale, power=first.power, of=tuple(objectives)))
            if self.combine == "sum" or first.is_magnitude:
                levels.append(self.summed(objectives))
        return tuple(levels)

    def summed(self, parts: Sequence[Objective]) -> Objective:
        """Sum over the members; a variable that bounds an objective replaces it if it is not smooth."""
        first = parts[0]
        figure = Alias(sum_name(first.figure, first.is_magnitude, first.power), first.figure)
        direct = first.is_smooth and not any(part.row in self.integrals or self.stands(part.row) for part in parts)
        rows = [part.row if direct else self.least(k, part) for k, part in enumerate(parts)]
        terms = [self.rows[row].formula if row in self.rows else functools.partial(_number, row) for row in rows]
        self.rows[figure] = DesignRow(functools.partial(_sum, terms))
        return Value(figure, figure, first.scale, power=first.power)

    def stands(self, row: str) -> bool:
        """Whether a row is at an event; a sum is at none."""
        return row in self.rows and bool(self.rows[row].event)

    def least(self, member: int, part: Objective) -> str:
        """Variable that bounds a member's objective from above, with the limits for this bound."""
        name = of_member(f"most {part.figure}", member)
        self.extra.append(Variable(name, -math.inf, math.inf, part.scale, (0.0, 2 * part.scale)))
        self.measured[name] = member, self.programs[member].objectives[self.place(part)]
        for place, (row, sign) in enumerate(part.sides):
            called, of = f"{name} {place}", self.rows.get(row)
            firm = {"relaxable": False, "hidden": True}
            if of is None:
                self.extra_limits.append(RatioLimit(called, 1, row, 1.0, part.scale, name, **firm))
                continue
            formula = functools.partial(_beyond, of.formula, sign, name)
            self.rows[called] = DesignRow(formula, event=of.event, loaded=False)
            self.extra_limits.append(DesignLimit(called, 1, called, 0.0, part.scale, **firm))
        for row in part.quantities:
            signs = (1.0,) if row in self.signed else (1.0, -1.0)
            for sign in signs:
                called = f"{name} {row} {sign:+g}"
                formula = functools.partial(_beyond, self.quantities[row].formula, sign, name)
                self.quantities[called] = CycleQuantity(formula, signed=True)
                self.extra_limits.append(CycleLimit(called, 1, called, 0.0, part.scale, relaxable=False, hidden=True))
        return name

    def place(self, objective: Objective) -> int:
        """Index of a level of the family among the levels of a member."""
        return next(k for k, level in enumerate(self.first.objectives) if level.figure == objective.figure)

    @property
    def signed(self) -> frozenset[str]:
        """Quantities of the family whose largest value counts, not the largest magnitude."""
        return frozenset(name for name, quantity in self.quantities.items() if quantity.signed)

    # The program.

    def family(self) -> Family:
        """Program of the family, and the part of each member."""
        limits, objectives = self.limits(), self.objectives()
        places = range(len(self.variables))
        variables = {
            v.name: v for k in range(len(self.programs)) for v in (self.variable(k, place) for place in places)
        }
        values = {
            self.name(k, name): value
            for k, program in enumerate(self.programs)
            for name, value in program.parameters.items()
        }
        tops = {
            self.name(k, name): self.read(k, of)
            for k in range(len(self.programs))
            for name, of in self.first.tops.items()
        }
        parts = tuple(self.part(k) for k in range(len(self.programs)))
        whole = Program(
            self.whole(),
            (*variables.values(), *self.extra),
            values,
            (*limits, *self.extra_limits),
            objectives,
            (),
            tuple(self.moves()),
            functools.partial(_followed, parts, dict(self.measured)),
            tops,
            {self.name(k, name): value for k, case in enumerate(self.programs) for name, value in case.today.items()},
            any_numbers=self.first.any_numbers,
        )
        return Family(replace(whole, starts=self.starts(whole)), parts)

    def part(self, member: int) -> MemberShare:
        """Part of a member in the family."""
        limits = {limit.name: self.limit(member, limit).name for limit in self.programs[member].limits}
        return MemberShare(
            self.programs[member],
            {name: self.name(member, name) for name in self.variables},
            {name: whole for name, whole in limits.items() if name != whole},
        )

    def starts(self, whole: Program) -> tuple[dict[str, float], ...]:
        """Starts of the family: the members' k-th starts combined, with the shared variables of each member in turn."""
        starts: list[dict[str, float]] = []
        for place in range(max(len(program.starts) for program in self.programs)):
            group = [program.starts[min(place, len(program.starts) - 1)] for program in self.programs]
            values = {self.name(k, name): value for k, start in enumerate(group) for name, value in start.items()}
            for start in group:
                shared = {name: value for name, value in start.items() if name not in self.apart}
                given = {**values, **shared}
                inside = {v.name: min(max(given[v.name], v.lower), v.upper) for v in whole.variables if v.name in given}
                completed = whole.completed(inside)
                if completed not in starts:
                    starts.append(completed)
        return tuple(starts)

    def moves(self) -> list[Move]:
        """Moves of the members; a move along shared variables occurs once, with the preferences of all members."""
        moves: dict[Hashable, Move] = {}
        for k, program in enumerate(self.programs):
            for move in program.moves:
                along = tuple(self.name(k, name) for name in move.along)
                wishes = tuple(wish._replace(when=self.name(k, wish.when) if wish.when else "") for wish in move.wishes)
                today = {self.name(k, name): value for name, value in move.today.items()}
                bounds = {self.name(k, name): ends for name, ends in move.bounds.items()}
                is_separate = along != move.along
                key = move.name, along
                if key in moves:  # wishes that always hold are the last
                    wishes = tuple(sorted(dict.fromkeys((*moves[key].wishes, *wishes)), key=lambda wish: not wish.when))
                named = of_member(move.name, k) if is_separate else move.name
                moves[key] = replace(move, name=named, along=along, wishes=wishes, today=today, bounds=bounds)
        return list(moves.values())


def _followed(
    parts: Sequence[MemberShare], measured: Mapping[str, tuple[int, Objective]], model: JobModel, values: Numbers
) -> dict[str, float]:
    """Variables that follow from the others: those of the members, and the bounds of their objectives."""
    variables: dict[str, float] = {}
    for part in parts:
        results = part.program.follow(part.program.model, {**part.program.parameters, **part.member_values(values)})
        variables |= {part.names[name]: value for name, value in results.items() if name in part.names}
    for name, (member, objective) in measured.items():
        variables[name] = objective.merit(parts[member].sampler({**values, **variables}))
    return variables
