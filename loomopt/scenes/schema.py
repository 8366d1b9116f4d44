"""All that a scene needs to know of its job, so that it can be read and checked without knowing any."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue
from loomopt.physics.effects.kinds import Effect
from loomopt.physics.schema import Axis, Conflict, Figure, Sense, Table, Target


@dataclass(frozen=True)
class SceneSchema:
    """What a scene of a job may hold; it may follow from the raw scene.

    operation, mechanism: models of those tables; keys that are required only by what reads them are optional there.
    effects: by name, in the order of the job. variables: design variables → kind of quantity, in the order shown.
    figures: the job's own; those of its effects come with them (`all_figures`).
    fault(design, shown): why a design, SI, cannot work as this mechanism, its numbers as `shown` tells them; "" when
    it can.
    margins: limits that every design keeps → kind of quantity; their names are whole phrases.
    groups: name → bounds that --free frees together.
    partly_known: whether the job honours loads that are known on some pieces of the cycle only.
    parts: whether the job honours effects by which the output may part from the mechanism.
    lists: parts of a design that are lists of numbers → their kind of quantity; inside, NAME_0, NAME_1 ...
    own_axes: axes that are read otherwise than under their own name.
    conflict: the two axes whose front stands among the reference results, for the scene that is named after its job.
    """

    name: str
    title: str
    operation: type[Table]
    mechanism: type[Table]
    effects: Mapping[str, Effect]
    variables: Mapping[str, str]
    own_figures: Mapping[str, Figure]
    targets: Mapping[str, Target]
    default_target: str
    fault: Callable[[Mapping[str, float], ShowValue], str]
    needs: tuple[str, ...] = ()
    own_margins: Mapping[str, str] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lists: Mapping[str, str] = field(default_factory=dict)
    partly_known: bool = False
    parts: bool = False
    own_axes: Mapping[str, Axis] = field(default_factory=dict)
    conflict: Conflict | None = None

    @lazy
    def figures(self) -> dict[str, Figure]:
        """Figures of the job, then those of its effects."""
        return {**self.own_figures, **{f.name: f for effect in self.effects.values() for f in effect.figures}}

    @property
    def axes(self) -> dict[str, Axis]:
        """What can be traded: variables, and every figure that can be limited; a job's own axes say it their way."""
        ends: dict[str, tuple[Sense, ...]] = {"min": ("most",), "max": ("least",)}
        found = {name: Axis(name, kind) for name, kind in self.variables.items()}
        for figure in self.figures.values():
            senses = tuple(sense for side in figure.sides for sense in ends[side])
            if senses and figure.name not in found:
                found[figure.name] = Axis(figure.name, figure.kind, senses=senses[::-1])
        return {**found, **self.own_axes}

    @property
    def margins(self) -> dict[str, str]:
        """Margins of the job, then those of its effects."""
        found = dict(self.own_margins)
        for effect in self.effects.values():
            found |= effect.margins
        return found
