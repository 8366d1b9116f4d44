"""[targets.family]: one machine for several sets of scene numbers; each set is a scene."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field

from loomopt.base.errors import BadInput, refusal, unknown
from loomopt.base.records import Frozen
from loomopt.physics.schema import Name, Target, TargetTable
from loomopt.scenes import synonyms
from loomopt.scenes.document import removed
from loomopt.scenes.scene import TABLES, Scene, build, cached, places
from loomopt.scenes.tables import FAMILY

MOST_MEMBERS = 50
"""Members that a family may have: each is a machine of its own in one problem."""


class FamilyTarget(TargetTable):
    """Values of the target family."""

    of: Name | None = Field(None, description="the target of each member; the job's default without it")
    combine: Literal["worst", "sum"] = Field(
        "worst", description="minimise the worst member, or the sum over the members"
    )
    members: list[dict[str, Any]] = Field(
        [], description='scene numbers of each member: { M0 = "600 N*m" }, or dotted keys'
    )
    own: list[Name] = Field([], description="design variables that each member has for itself; all others are shared")


TARGET = Target(FAMILY, "one machine for several sets of numbers: the least worst of its members", FamilyTarget)


def table(scene: Scene) -> FamilyTarget:
    """Table of a scene's family."""
    target = scene.targets[FAMILY]
    assert isinstance(target, FamilyTarget)
    return target


def of_target(scene: Scene) -> str:
    """Target of all members. Raises BadInput for a target that the job does not have."""
    name = table(scene).of or scene.schema.default_target
    known = [target for target in scene.schema.targets if target != FAMILY]
    if name not in known:
        raise unknown("target", name, known, scene.origin, f"targets.{FAMILY}.of")
    return name


def changes(scene: Scene) -> tuple[dict[str, Any], ...]:
    """Changes of the scene by each member: dotted key → value. Raises BadInput."""
    return tuple(_changes(scene, place) for place in range(len(_members(scene))))


def members(scene: Scene) -> tuple[Scene, ...]:
    """Scene of each member. Raises BadInput that names the member and the key."""
    return cached(scene, FAMILY, lambda: tuple(_member(scene, k, change) for k, change in enumerate(changes(scene))))


def member_name(name: str, member: int) -> str:
    """Name within the family of a member's number; members are counted from 1 where a person reads them."""
    return f"{name}[{member + 1}]"


def sum_name(figure: str, magnitude: bool, power: int = 1) -> str:
    """Name of the sum of the members' figures, or of the root of the sum of their powers."""
    if power == 1:
        return f"sum of |{figure}|" if magnitude else f"sum of {figure}"
    return f"root sum of squares of {figure}" if power == 2 else f"root sum of powers of {figure}"


def called(scene: Scene) -> Mapping[str, str]:
    """Names of numbers and figures within the family → their names within a member."""
    names = (*scene.schema.figures, *scene.schema.variables, *scene.bounds)
    count = len(table(scene).members)

    def names_of_members() -> dict[str, str]:
        member_names = {member_name(name, k): name for name in names for k in range(count)}
        kinds = ((True, 1), (False, 1), (False, 2), (False, -1))
        return member_names | {sum_name(name, *kind): name for name in names for kind in kinds}

    return cached(scene, "family names", names_of_members)


def _members(scene: Scene) -> list[dict[str, Any]]:
    members, key = table(scene).members, f"targets.{FAMILY}.members"
    if not members:
        raise refusal("a family needs members", scene.origin, key, remedy='Write members = [{ M0 = "600 N*m" }, ...]')
    if len(members) > MOST_MEMBERS:
        raise refusal(
            "the family has too many members",
            scene.origin,
            key,
            str(len(members)),
            f"1 to {MOST_MEMBERS}",
            "Take some out",
        )
    return members


def _changes(scene: Scene, place: int) -> dict[str, Any]:
    at, given = f"targets.{FAMILY}.members[{place + 1}]", _members(scene)[place]
    if not given:
        raise refusal("the member changes nothing", scene.origin, at, remedy='Write { M0 = "600 N*m" }')
    changes: dict[str, Any] = {}
    free = {f"{p.table}.{p.key}" for p in places(scene) if (bound := scene.bounds.get(p.label)) and bound.free}
    for raw_key, value in _flat(scene, at, given):
        key = synonyms.current_key(raw_key, scene.schema.synonyms, scene.document)
        if key in changes:
            raise refusal("it is changed twice", scene.origin, f"{at}.{key}", remedy="Take one of them out")
        if key in free:
            problem, remedy = "it is free: the family chooses it", "Change its bounds, or take it out"
            raise refusal(problem, scene.origin, f"{at}.{key}", remedy=remedy)
        changes[key] = value
    return changes


def _flat(scene: Scene, at: str, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Dotted keys with their values; a short name stands for the one number of that name."""
    numbers = places(scene)
    for name, value in given.items():
        if name in TABLES or "." in name:
            yield from _leaves(name, value)
            continue
        keys = [f"{p.table}.{p.key}" for p in numbers if name in (p.key, p.label) and p.given]
        keys = keys or synonyms.keys_of(name, scene.schema.synonyms, scene.document)
        if len(keys) != 1:
            known = sorted({p.label for p in numbers if p.given})
            if not keys:
                raise unknown("number", name, known, scene.origin, f"{at}.{name}")
            problem, remedy = f"{name} may mean {', '.join(keys)}", f"Write one of them in place of {name}"
            raise refusal(problem, scene.origin, f"{at}.{name}", remedy=remedy)
        yield keys[0], value


def _leaves(key: str, value: object) -> Iterator[tuple[str, Any]]:
    """Values inside tables by their dotted keys."""
    if not isinstance(value, Mapping):
        yield key, value
        return
    for name, inner in value.items():
        yield from _leaves(f"{key}.{name}", inner)


def _without_family(scene: Scene) -> Scene:
    """Scene without its family."""
    settings = {key: value for key, value in scene.call.set.items() if not f"{key}.".startswith(f"targets.{FAMILY}.")}
    call = replace(scene.call, set=Frozen(settings), target=None)
    return build(removed(scene.document, ("targets", FAMILY)), scene.jobs, scene.origin, scene.paths, call)


def _member(scene: Scene, place: int, change: Mapping[str, Any]) -> Scene:
    at = f"targets.{FAMILY}.members[{place + 1}]"
    for key in change:
        if key.split(".")[0] in ("targets", "problem"):
            allowed = "operation, mechanism, effects, bounds, limits"
            raise refusal(
                "a member cannot change it", scene.origin, f"{at}.{key}", allowed=allowed, remedy="Take it out"
            )
    try:
        return _without_family(scene).update(change)
    except BadInput as error:
        first = error.faults[0]
        raise BadInput(
            first.problem,
            file=scene.origin,
            key=f"{at}.{first.key}",
            value=first.value,
            allowed=first.allowed,
            remedy=first.remedy,
        ) from None
