"""loomopt: optimal design of weaving-loom mechanisms, certified.

>>> import loomopt as lo
>>> answer = lo.solve(lo.load("beatup-light"), target="balance")
"""

from loomopt.base import __version__ as __version__

TYPE_CHECKING = False  # as type checkers know it: `typing` would be nearly all that importing this takes
if TYPE_CHECKING:
    from loomopt.base.errors import BadInput
    from loomopt.interface.api import (
        Answer,
        Evaluation,
        accuracy,
        budget,
        compare,
        effects,
        evaluate,
        load,
        new,
        pareto,
        problems,
        prove,
        scene,
        schema,
        sensitivity,
        simulate,
        solve,
        sweep,
        tolerance,
    )
    from loomopt.interface.study.accuracy import AccuracyStudy
    from loomopt.interface.study.budget import Budget
    from loomopt.interface.study.effects import EffectsStudy
    from loomopt.interface.study.points import StudyTable
    from loomopt.interface.study.sensitivity import SensitivityStudy
    from loomopt.interface.study.tolerance import ToleranceStudy
    from loomopt.scenes.scene import Scene
    from loomopt.solving.answer.solution import Proofs

_HOMES = {
    "Answer": "loomopt.interface.api",
    "BadInput": "loomopt.base.errors",
    "Budget": "loomopt.interface.study.budget",
    "EffectsStudy": "loomopt.interface.study.effects",
    "Evaluation": "loomopt.interface.api",
    "Proofs": "loomopt.solving.proof.whole_cycle",
    "Scene": "loomopt.scenes.scene",
    "accuracy": "loomopt.interface.api",
    "compare": "loomopt.interface.api",
    "AccuracyStudy": "loomopt.interface.study.accuracy",
    "SensitivityStudy": "loomopt.interface.study.sensitivity",
    "StudyTable": "loomopt.interface.study.points",
    "ToleranceStudy": "loomopt.interface.study.tolerance",
    "budget": "loomopt.interface.api",
    "effects": "loomopt.interface.api",
    "evaluate": "loomopt.interface.api",
    "load": "loomopt.interface.api",
    "new": "loomopt.interface.api",
    "pareto": "loomopt.interface.api",
    "problems": "loomopt.interface.api",
    "prove": "loomopt.interface.api",
    "scene": "loomopt.interface.api",
    "schema": "loomopt.interface.api",
    "sensitivity": "loomopt.interface.api",
    "simulate": "loomopt.interface.api",
    "solve": "loomopt.interface.api",
    "sweep": "loomopt.interface.api",
    "tolerance": "loomopt.interface.api",
}

_FORMER_NAMES = {"DesignStudy": "StudyTable", "AccuracyFound": "AccuracyStudy"}
"""Today's name of each renamed class; the former ones go in the next version."""

__all__ = [
    "AccuracyStudy",
    "Answer",
    "BadInput",
    "Budget",
    "EffectsStudy",
    "Evaluation",
    "Proofs",
    "Scene",
    "SensitivityStudy",
    "StudyTable",
    "ToleranceStudy",
    "accuracy",
    "budget",
    "compare",
    "effects",
    "evaluate",
    "load",
    "new",
    "pareto",
    "problems",
    "prove",
    "scene",
    "schema",
    "sensitivity",
    "simulate",
    "solve",
    "sweep",
    "tolerance",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first used, which keeps the start of the command line short."""
    from importlib import import_module

    if name in _FORMER_NAMES:
        from warnings import warn

        now = _FORMER_NAMES[name]
        warn(f"loomopt.{name} is now loomopt.{now}; the old name goes in the next version", DeprecationWarning, 2)
        name = now
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Public names, for completion and `help`, without an import of their modules."""
    return [*__all__, "__version__"]
