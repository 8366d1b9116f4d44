"""A job's effects: every file of its folder that declares one."""

import functools
import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from loomopt.physics.effects.kinds import Effect, Load, State, ranked
from loomopt.physics.schema import Table


@functools.cache
def of(package: str) -> Mapping[str, Effect]:
    """Return the effects that the modules of a package declare as EFFECT, by name, the lowest rank first."""
    folder = importlib.import_module(package)
    names = [found.name for found in pkgutil.iter_modules(folder.__path__)]
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    return ranked(module.EFFECT for module in modules if hasattr(module, "EFFECT"))


class Fault(NamedTuple):
    """An effect that cannot be on: the other effect that is missing or in its way, and the problem in words."""

    effect: Effect
    other: str
    missing: bool
    problem: str


def faults(active: Mapping[Effect, Table]) -> Iterator[Fault]:
    """Yield what keeps effects from being on together; active: effects with their tables, in the order of the job."""
    tables = {effect.name: own for effect, own in active.items()}
    for effect in active:
        for name in effect.beside:
            if name not in tables:
                yield Fault(effect, name, True, f"effect {effect.name} needs the effect {name}")
        carried = effect.carries if isinstance(effect, State) else ()
        for load in active:
            if isinstance(load, Load) and load.name in carried and load.corners and not load.response:
                problem = f"effect {effect.name} carries {load.name}, which has corners: its answer has no closed form"
                yield Fault(effect, load.name, False, problem)
        for clash in effect.clashes:
            if clash.effect in tables:
                word = str(getattr(tables[clash.effect], clash.key)) if clash.key else ""
                if not clash.words or word in clash.words:
                    kind = f" with {clash.key} {word}" if word else ""
                    problem = f"effects {effect.name} and {clash.effect}{kind} cannot be on together: {clash.why}"
                    yield Fault(effect, clash.effect, False, problem)
