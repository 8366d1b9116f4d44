"""What a solve is asked for, checked before anything is computed."""

from loomopt.errors import BadInput
from loomopt.scenes import Scene
from loomopt.tolerances import ACCURACY as ACCURACY
from loomopt.tolerances import COARSEST, MOST_STARTS, TIGHTEST


def target_name(scene: Scene, target: str | None) -> str:
    """Return the target's name, the job's default without one."""
    name = target or scene.schema.default_target
    if name not in scene.schema.targets:
        raise BadInput(
            f"job {scene.job} has no target {name}",
            file=scene.origin,
            key="target",
            value=name,
            allowed=", ".join(scene.schema.targets),
            remedy="Choose one of them.",
        )
    return name


def check_numbers(accuracy: float, starts: int | None) -> None:
    """Raise BadInput for settings outside what can be kept."""
    if not TIGHTEST <= accuracy <= COARSEST:
        raise BadInput(
            "the accuracy is out of range",
            key="accuracy",
            value=f"{accuracy:g}",
            allowed=f"{TIGHTEST:g} to {COARSEST:g}",
            remedy="Give 1e-8, or leave it out.",
        )
    if starts is not None and not 1 <= starts <= MOST_STARTS:
        raise BadInput(
            "the number of starts is out of range",
            key="starts",
            value=str(starts),
            allowed=f"1 to {MOST_STARTS}",
            remedy="Give 20, or leave it out.",
        )
