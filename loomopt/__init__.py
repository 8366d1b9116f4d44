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
        effects,
        evaluate,
        load,
        pareto,
        prove,
        scene,
        simulate,
        solve,
        sweep,
    )
    from loomopt.interface.finished import DesignStudy, EffectsStudy
    from loomopt.scenes.scene import Scene
    from loomopt.solving.answer.solution import Proofs

_HOMES = {
    "Answer": "loomopt.interface.api",
    "BadInput": "loomopt.base.errors",
    "DesignStudy": "loomopt.interface.finished",
    "EffectsStudy": "loomopt.interface.finished",
    "Evaluation": "loomopt.interface.api",
    "Proofs": "loomopt.solving.proof.whole_cycle",
    "Scene": "loomopt.scenes.scene",
    "effects": "loomopt.interface.api",
    "evaluate": "loomopt.interface.api",
    "load": "loomopt.interface.api",
    "pareto": "loomopt.interface.api",
    "prove": "loomopt.interface.api",
    "scene": "loomopt.interface.api",
    "simulate": "loomopt.interface.api",
    "solve": "loomopt.interface.api",
    "sweep": "loomopt.interface.api",
}

__all__ = [
    "Answer",
    "BadInput",
    "DesignStudy",
    "EffectsStudy",
    "Evaluation",
    "Proofs",
    "Scene",
    "effects",
    "evaluate",
    "load",
    "pareto",
    "prove",
    "scene",
    "simulate",
    "solve",
    "sweep",
]


def __getattr__(name: str) -> object:
    """Import the public names when they are first asked for: the command line starts without what it does not use."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the public names: what an editor completes and `help` shows, nothing imported for it."""
    return [*__all__, "__version__"]
