"""loomopt: optimal design of weaving-loom mechanisms, certified.

>>> import loomopt as lo
>>> answer = lo.solve(lo.load("beatup-light"), target="balance")
"""

TYPE_CHECKING = False  # as type checkers know it: `typing` would be nearly all that importing this takes
if TYPE_CHECKING:
    from loomopt.api import Answer, Evaluation, effects, evaluate, load, pareto, prove, scene, simulate, solve, sweep
    from loomopt.base.errors import BadInput
    from loomopt.design_study import DesignStudy
    from loomopt.effects_study import EffectsStudy
    from loomopt.scene.scene import Scene
    from loomopt.solve.proof.whole_cycle import Proofs

__version__ = "0.1.0"

_HOMES = {
    "Answer": "loomopt.api",
    "BadInput": "loomopt.base.errors",
    "DesignStudy": "loomopt.design_study",
    "EffectsStudy": "loomopt.effects_study",
    "Evaluation": "loomopt.api",
    "Proofs": "loomopt.solve.proof.whole_cycle",
    "Scene": "loomopt.scene.scene",
    "effects": "loomopt.api",
    "evaluate": "loomopt.api",
    "load": "loomopt.api",
    "pareto": "loomopt.api",
    "prove": "loomopt.api",
    "scene": "loomopt.api",
    "simulate": "loomopt.api",
    "solve": "loomopt.api",
    "sweep": "loomopt.api",
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
