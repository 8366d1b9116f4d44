"""Options of a solve, checked before anything is computed."""

import math
from collections.abc import Callable
from typing import NamedTuple

from loomopt.base import arguments
from loomopt.base.errors import BadInput, nearest, refusal, shown
from loomopt.physics.effects.kinds import EVALUATED
from loomopt.physics.tolerances import COARSEST, TIGHTEST
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import FAMILY

MOST_STARTS = 10_000
"""Largest number of starts: it takes hours, and more is a typing error."""

GAP, SECONDS = 1e-3, 60.0
"""Usual gap of a global proof, relative to each objective, and its usual time limit, s."""
OMITTED = 0.01
"""Usual share of an objective's scale that leaving out an effect may change."""
LEAST_GAP, MOST_GAP = 1e-6, 0.5
"""Range of gaps: an answer is right to 1e-8, and boxes close ever more slowly round it."""


class GlobalProof(NamedTuple):
    """Request for a proof that no admissible design is better.

    gap: relative to each objective; seconds: time limit; say: function that takes the progress as text.
    """

    gap: float = GAP
    seconds: float = SECONDS
    say: Callable[[str], None] = lambda text: None


def check(
    scene: Scene, accuracy: float, starts: int | None, seed: int, global_proof: GlobalProof | None = None
) -> None:
    """Raise BadInput for a scene that cannot be solved, or for options out of range."""
    check_effects(scene)
    check_numbers(accuracy, starts, seed)
    check_global_proof(global_proof)


def check_global_proof(proof: GlobalProof | None) -> None:
    """Raise BadInput for a gap or a time out of range, where there is a proof."""
    if proof is None:
        return
    arguments.number(proof.gap, "gap", f"{LEAST_GAP:g} to {MOST_GAP:g}", "Give 1e-3 as a number, or leave it out")
    arguments.number(proof.seconds, "seconds", "seconds, more than 0", "Give 60 as a number, or leave it out")
    if not LEAST_GAP <= proof.gap <= MOST_GAP:
        raise BadInput(
            "the gap is out of range",
            key="--gap",
            value=f"{proof.gap:g}",
            allowed=f"{LEAST_GAP:g} to {MOST_GAP:g}",
            remedy="Write --gap 1e-3, or leave it out.",
        )
    if not 0 < proof.seconds < math.inf:
        raise BadInput(
            "the time is out of range",
            key="--time",
            value=f"{proof.seconds:g}",
            allowed="seconds, more than 0",
            remedy="Write --time 60, or leave it out.",
        )


def target_name(scene: Scene, target: str | None, families: bool = False) -> str:
    """Name of the target; without one that of the answer the scene comes from, else the job's default.

    families: whether the call can serve several machines at once. Raises BadInput.
    """
    if target is not None:
        arguments.text(target, "target", ", ".join(scene.schema.targets), "Choose one of them")
    name = target or scene.call.target or scene.schema.default_target
    if name not in scene.schema.targets:
        near = nearest(name, scene.schema.targets)
        raise BadInput(
            f"job {scene.job} has no target {name}",
            file=scene.origin,
            key="target",
            value=name,
            allowed=", ".join(scene.schema.targets),
            remedy=_remedy(name, near),
        )
    if name == FAMILY and not families:
        remedy = "Choose the target of one member, with its numbers set"
        raise refusal("a family can only be solved and swept", scene.origin, "target", name, remedy=remedy)
    return name


def _remedy(name: str, near: str) -> str:
    if name == FAMILY:
        return f"Add the table [targets.{FAMILY}] with members, or choose one of them"
    return f'Perhaps "{near}" is meant' if near else "Choose one of them"


def check_effects(scene: Scene, command: str = "solve") -> None:
    """Raise BadInput where an effect takes part only where a given design is evaluated; command: the command."""
    for effect in scene.active:
        if isinstance(effect, EVALUATED):
            problem = (
                f"{command} does not cover effect {effect.name}: with it, a design is evaluated and simulated only"
            )
            remedy = f"Take it off (--without {effect.name}): {command} without it, evaluate with it"
            raise refusal(problem, scene.origin, f"effects.{effect.name}", remedy=remedy)


def check_numbers(accuracy: float, starts: int | None, seed: int = 0) -> None:
    """Raise BadInput for settings out of range."""
    accuracy = arguments.number(
        accuracy, "accuracy", f"{TIGHTEST:g} to {COARSEST:g}", "Give 1e-8 as a number, or leave it out"
    )
    if starts is not None:
        arguments.whole(starts, "starts", f"1 to {MOST_STARTS}", "Give 20, or leave it out")
    if arguments.whole(seed, "seed", "0 or more", "Give 0, or leave it out") < 0:
        raise refusal("it is less than 0", "", "seed", seed, "0 or more", "Give 0, or leave it out")
    if not TIGHTEST <= accuracy <= COARSEST:
        raise BadInput(
            "the accuracy is out of range",
            key="accuracy",
            value=shown(accuracy),
            allowed=f"{TIGHTEST:g} to {COARSEST:g}",
            remedy="Give 1e-8, or leave it out.",
        )
    if starts is not None and not 1 <= starts <= MOST_STARTS:
        raise BadInput(
            "the number of starts is out of range",
            key="starts",
            value=shown(starts),
            allowed=f"1 to {MOST_STARTS}",
            remedy="Give 20, or leave it out.",
        )
