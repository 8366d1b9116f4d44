"""A family as one job: the programs of its members together, and each member's share of an answer."""

import functools
from collections.abc import Collection, Mapping, Sequence
from typing import final

from loomopt.base.errors import refusal, unknown
from loomopt.jobs.base import Figures, Job
from loomopt.model.curves import Columns
from loomopt.model.family import Family, MemberShare, of_member, standing_for, together
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.physics.effects.kinds import Event, Speed, State
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scenes import family
from loomopt.scenes.scene import Scene, cached
from loomopt.scenes.tables import FAMILY


@final
class FamilyJob(Job):
    """The members of a scene's family; job: whose mechanism they all have."""

    name = FAMILY

    def __init__(self, job: Job, scene: Scene) -> None:
        self.job, self.scene = job, scene
        self.own_schema, self.target = scene.schema, family.of_target(scene)
        self.members = family.members(scene)

    def open_boxes(self, model: JobModel) -> str:
        """Boxes of several machines are not bounded."""
        return "it is several machines in one problem"

    @functools.cached_property
    def family(self) -> Family:
        """The program of all, and the share of each. Raises BadInput."""
        return cached(self.scene, (FAMILY, FAMILY), self._family)

    @property
    def parts(self) -> tuple[MemberShare, ...]:
        """The share of each member."""
        return self.family.parts

    @functools.cached_property
    def separate(self) -> frozenset[str]:
        """Numbers of a design, by full name, of which each member has its own."""
        return frozenset(self.scene.full(name) for name in family.table(self.scene).own)

    def check(self, scene: Scene) -> None:
        """Raise BadInput where a member's machine is not one that the job can work on."""
        for member in family.members(scene):
            self.job.check(member)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput where a member lacks a number or an effect that the target needs."""
        for member in self.members:
            self.job.demand(member, self.target)

    def model(self, scene: Scene, design: Mapping[str, float] | None = None) -> JobModel:
        """Model of all members."""
        return self.family.program.model

    def program(self, scene: Scene, target: str) -> Program:
        """Task of all members. Raises BadInput."""
        return self.family.program

    def _family(self) -> Family:
        programs = [self.job.program(member, self.target) for member in self.members]
        first, key = programs[0], f"targets.{FAMILY}"
        for place, program in enumerate(programs):
            if program.model.key != first.model.key or _structure(program) != _structure(first):
                problem = f"member {place + 1} is another kind of machine than member 1: numbers alone may differ"
                remedy = "Take what differs in effects, words and limits out of it"
                raise refusal(problem, self.scene.origin, f"{key}.members[{place + 1}]", remedy=remedy)
        states = [effect.name for effect in first.model.effects if isinstance(effect, State | Speed | Event)]
        if states or first.model.known_in:
            named = ", ".join(states) or "a load that is known in part of the cycle only"
            remedy = f"Take it off{f' (--without {states[0]})' if states else ''}, or solve each member by itself"
            raise refusal(f"a family cannot be solved with {named}", self.scene.origin, key, remedy=remedy)
        given, separate = family.table(self.scene).own, set[str]()
        variables = [name for name in self.scene.bounds if standing_for(first, self.scene.full(name))]
        for place, name in enumerate(given):
            stands = standing_for(first, self.scene.full(name)) if name in variables else frozenset()
            if not stands:
                raise unknown("design variable", name, variables, self.scene.origin, f"{key}.own[{place + 1}]")
            separate |= stands
        if self.job.sizes(self.scene):
            named = ", ".join(self.job.sizes(self.scene))
            problem = "stock sizes cannot be chosen for a family"
            raise refusal(problem, self.scene.origin, f"bounds.{named}", remedy="Take the list of stock sizes out")
        return together(programs, separate, family.table(self.scene).combine)

    # Designs: what is shared under its own name, what is not under the member's.

    def today(self, scene: Scene) -> dict[str, float]:
        """Today's design."""
        return self._whole([self.job.today(member) for member in self.members])

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Design, SI, of the variables."""
        return self._whole(self.designs(x))

    def designs(self, x: Numbers) -> list[dict[str, float]]:
        """Design, SI, of each member."""
        return [self.job.design(part.program, part.member_values(x)) for part in self.parts]

    def member_designs(self, design: Numbers) -> list[dict[str, float]]:
        """Design, SI, of each member, of the whole's."""
        plain = self.job.today(self.members[0])
        named = {name: [of_member(name, k) for k in range(len(self.members))] for name in plain}
        return [
            {name: design.get(named[name][k], design.get(name, plain[name])) for name in plain}
            for k in range(len(self.members))
        ]

    def _whole(self, designs: Sequence[Mapping[str, float]]) -> dict[str, float]:
        whole: dict[str, float] = {}
        for name in dict.fromkeys(name for design in designs for name in design):
            by_member = {k: design[name] for k, design in enumerate(designs) if name in design}
            values = list(by_member.values())
            alike = len(by_member) == len(designs) and max(values) - min(values) <= FEASIBLE * max(map(abs, values))
            shared = alike and name not in self.separate
            whole |= {name: values[0]} if shared else {of_member(name, k): value for k, value in by_member.items()}
        return whole

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """Variables of a design."""
        pairs = zip(self.parts, self.member_designs(design), strict=True)
        members = [self.job.values(part.program, member_design) for part, member_design in pairs]
        return program.completed(self._joined(members, design))

    def tidy(self, program: Program, x: Numbers) -> dict[str, float]:
        """Variables without rounding errors."""
        tidied = self._joined([self.job.tidy(part.program, part.member_values(x)) for part in self.parts], x)
        return {**x, **tidied}

    def _joined(self, members: Sequence[Mapping[str, float]], otherwise: Numbers) -> dict[str, float]:
        """Members' variables as variables of the whole; `otherwise` for a shared one on which they do not agree."""
        joined: dict[str, float] = {}
        apart = set[str]()
        for part, member in zip(self.parts, members, strict=True):
            for name, value in member.items():
                whole = part.names[name]
                apart |= {whole} if joined.setdefault(whole, value) != value else set()
        return joined | {name: otherwise[name] for name in apart if name in otherwise}

    # What only members have.

    def sampler(self, scene: Scene, design: Numbers) -> Sampler:
        """Sampler of all members."""
        from loomopt.model.sampling import sampled

        program = self.family.program
        return sampled(program.model, {**program.parameters, **self.values(program, design)})

    def sizes(self, scene: Scene) -> Mapping[str, Sequence[float]]:
        """Empty: a family with numbers in sizes is refused."""
        return {}

    def explain(self, scene: Scene, clash: Collection[str]) -> str:
        """Empty: explanations are those of single members."""
        return ""

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Empty: sentences are those of single members."""
        return ""

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Raise BadInput: the members have separate curves."""
        raise refusal("a family has no curves of its own", scene.origin, "target", FAMILY, remedy="Draw one member")


def _structure(program: Program) -> tuple[object, ...]:
    """Structure of a program, which all members share: everything but numbers."""
    return (
        tuple(variable.name for variable in program.variables),
        tuple((type(limit), limit.name, limit.sign, limit.reads) for limit in program.limits),
        tuple(objective.structure for objective in program.objectives),
    )
