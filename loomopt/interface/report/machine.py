"""Moving mechanism: an SVG with today's machine faint behind it, and its positions as data for the script."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from loomopt.interface.report.markup import Markup, Part
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.physics.cycle import TURN, Floats
from loomopt.picture.job_views import Span
from loomopt.picture.motion import POSES, MechanismMotion, Turning, crank_angles
from loomopt.picture.shapes import Box
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene

SIDE, MARGIN = 1000.0, 40.0
"""Longer side of a moving picture and its margin, in its own units."""
TEXT, JOINT, GROUND = 26.0, 6.0, 16.0
"""Sizes in it: of letters, joints, and of a pivot's ground."""
TALLEST = 0.75
"""Height of a picture over its width, beyond which it is made smaller."""
COILS = 9
"""Coils of a spring's sign."""


@dataclass(frozen=True)
class Frame:
    """From metres, y up, to a picture's units, y down."""

    box: Box
    size: float

    def at(self, points: Floats) -> Floats:
        """Points, (n, 2) m, in the picture."""
        moved = np.column_stack([points[:, 0] - self.box.left, self.box.top - points[:, 1]])
        return np.round(moved * self.size + MARGIN, 1)

    @property
    def width(self) -> float:
        """Of the picture."""
        return (self.box.right - self.box.left) * self.size + 2 * MARGIN

    @property
    def height(self) -> float:
        """Of the picture."""
        return (self.box.top - self.box.bottom) * self.size + 2 * MARGIN


@working()
def part(scene: Scene, design: Design) -> Part | None:
    """Moving mechanism of a design, SI, with today's behind it where it is another; None without one."""
    job, full_design = registry.of(scene), flat(design)
    now = job.today(scene)
    full = {**now, **full_design}
    angles = crank_angles()
    moving = job.views.motion(scene, full, angles)
    if moving is None:
        return None
    ghost = None if full == now else assemble(scene, now, angles)
    marks = {n: m for n, m in job.views.marks(scene, full).items() if not isinstance(m, Span) and math.isfinite(m)}
    first = round(next(iter(marks.values()), 0.0) / TURN * POSES) % POSES
    shown = widget([moving], ghost, job.views.angle, scene.shown_in("angle"), first)
    return Part("The mechanism through its turn", (Markup(shown),))


def assemble(scene: Scene, design: Mapping[str, float], angles: Floats) -> MechanismMotion | None:
    """Today's mechanism; None where it does not assemble."""
    from loomopt.base.errors import BadInput

    try:
        return registry.of(scene).views.motion(scene, design, angles)
    except BadInput:
        return None


def widget(
    stages: Sequence[MechanismMotion],
    ghost: MechanismMotion | None,
    angle: str,
    unit: str,
    first: int = 0,
    labels: Sequence[str] = (),
) -> str:
    """Animation with a slider: of one design, or of several stages, such as points of a front.

    ghost: machine that is drawn dashed behind it; angle, unit: name of φ and its unit; first: index of the first pose,
    the only one without scripts; labels: one for each stage.
    """
    frame = frame_of([*stages, *([ghost] if ghost else [])])
    at_first = max(range(len(stages)), key=lambda k: len(stages[k].joints))  # some have parts that others have not
    both = ((ghost, "today"), (stages[at_first], "design"))
    layers = [_layer(layer, frame, kind, first) for layer, kind in both if layer]
    sides = f"0 0 {frame.width:.0f} {frame.height:.0f}"
    shown = f'<svg viewBox="{sides}" role="img" aria-label="the mechanism">{"".join(layers)}</svg>'
    poses = {"design": [_poses(stage, frame) for stage in stages]}
    poses |= {"today": [_poses(ghost, frame)]} if ghost else {}
    size = math.degrees(TURN / len(stages[0].angles)) if unit == "deg" else 0.0
    turns = [] if size else [f"{value:.4g}" for value in _shown_angles(stages[0].angles, unit)]
    data = {"unit": unit, "step": size, "angles": turns, "poses": poses, "told": list(labels)}
    packed = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    second = (
        f"<label>design {_slider('which', len(stages), at_first)}<output></output></label>" if len(stages) > 1 else ""
    )
    controls = (
        '<div class="controls" hidden><button type="button" class="play" aria-label="play or stop">&#9654;</button>'
        f"<label>{escape(angle)} {_slider('turn', len(stages[0].angles), first)}</label>"
        f'<output class="angle"></output>{second}</div>'
    )
    ghosted = '<p class="marks"><span class="k-today"><i></i>today, dashed</span></p>' if ghost else ""
    wide = min(1.0, TALLEST * frame.width / frame.height)
    return (
        f'<figure class="machine" tabindex="0" style="--wide:{wide:.3f}">'
        f'{shown}{controls}{ghosted}<script type="application/json">{packed}</script></figure>'
    )


def _slider(kind: str, count: int, at: int) -> str:
    return f'<input type="range" class="{kind}" min="0" max="{count - 1}" value="{at}">'


def _shown_angles(angles: Floats, unit: str) -> Floats:
    from loomopt.base.units import factor

    return np.asarray(angles / factor(unit))


def frame_of(motions: Sequence[MechanismMotion]) -> Frame:
    """Frame that takes all positions of all machines."""
    points = [np.asarray(list(motion.pivots.values()), dtype=float) for motion in motions]
    points += [at for motion in motions for at in motion.joints.values()]
    for motion in motions:
        for joint, radius in motion.rings:
            at = _all(motion, joint)
            points += [at - radius, at + radius]
        for piece in motion.turning:
            reach = max(math.hypot(*point) for point in piece.points)
            points += [_all(motion, piece.joint) - reach, _all(motion, piece.joint) + reach]
    (left, bottom), (right, top) = np.min(np.vstack(points), axis=0), np.max(np.vstack(points), axis=0)
    size = (SIDE - 2 * MARGIN) / max(right - left, top - bottom)
    return Frame(Box(float(left), float(bottom), float(right), float(top)), float(size))


def _all(motion: MechanismMotion, joint: str) -> Floats:
    """A joint's positions, (n, 2) m; of a fixed one its only one."""
    return motion.joints[joint] if joint in motion.joints else np.asarray([motion.pivots[joint]], dtype=float)


def _poses(motion: MechanismMotion, frame: Frame) -> dict[str, object]:
    """Positions of moving joints in the picture, in tenths, and turns of its pieces, in degrees."""
    joints = {name: (10 * frame.at(at)).round().astype(int).ravel().tolist() for name, at in motion.joints.items()}
    turns = [np.round(-np.degrees(piece.turns), 2).tolist() for piece in motion.turning]
    fixed = {name: (10 * frame.at(_all(motion, name))).round().astype(int).ravel().tolist() for name in motion.pivots}
    sizes = [round(radius * frame.size, 1) for _, radius in motion.rings]
    pieces = [_outline(piece.points, frame) for piece in motion.turning]
    return {"joints": joints, "turns": turns, "fixed": fixed, "rings": sizes, "pieces": pieces}


def _outline(points: Sequence[tuple[float, float]], frame: Frame) -> str:
    return " ".join(f"{x * frame.size:.1f},{-y * frame.size:.1f}" for x, y in points)


def _layer(motion: MechanismMotion, frame: Frame, kind: str, pose: int) -> str:
    """SVG of one machine at one pose, with data for the script: joints of the lines, pieces that turn."""
    at = {name: frame.at(_all(motion, name))[0] for name in motion.pivots}
    at |= {name: frame.at(points)[pose] for name, points in motion.joints.items()}
    marks = [
        _path(frame.at(points))
        for name, points in motion.joints.items()
        if kind == "design" and name not in motion.unnamed
    ]
    marks += [_piece(place, piece, at, frame, pose) for place, piece in enumerate(motion.turning)]
    for place, (joint, radius) in enumerate(motion.rings):
        still = "guide" if joint in motion.pivots else "ring"
        size = f'r="{radius * frame.size:.1f}"'
        marks.append(f'<circle class="{still}" data-ring="{place}" {_centre(joint, at)} {size}/>')
    for first, second in motion.links:
        still = " frame" if first in motion.pivots and second in motion.pivots else ""
        ends = f'x1="{at[first][0]}" y1="{at[first][1]}" x2="{at[second][0]}" y2="{at[second][1]}"'
        marks.append(f'<line class="link{still}" {_link_data(first, second)} {ends}/>')
    for first, second in motion.springs:
        marks.append(f'<path class="return-spring" {_link_data(first, second)} d="{_spring(at[first], at[second])}"/>')
    marks += [f'<path class="ground" data-at="{escape(name)}" d="{_ground(*at[name])}"/>' for name in motion.pivots]
    marks += [f'<circle class="joint" {_centre(name, at)} r="{JOINT}"/>' for name in at if name not in motion.unnamed]
    if kind == "design":
        marks += [
            f'<text data-at="{escape(name)}" x="{at[name][0] + 10}" y="{at[name][1] - 10}">{escape(name)}</text>'
            for name in joint_names(motion, frame)
        ]
    return f'<g class="{kind}">{"".join(marks)}</g>'


def joint_names(motion: MechanismMotion, frame: Frame) -> list[str]:
    """Joints whose names have room: no moving one that comes too near to a pivot or to one before it."""
    joints: list[str] = []
    for name in (*motion.pivots, *motion.joints):
        if name not in motion.unnamed:
            apart = (np.hypot(*(frame.at(_all(motion, name)) - frame.at(_all(motion, other))).T) for other in joints)
            if all(float(np.min(distance)) > 1.3 * TEXT for distance in apart):
                joints.append(name)
    return joints


def _piece(place: int, piece: Turning, at: Mapping[str, Floats], frame: Frame, pose: int) -> str:
    """SVG of a piece that turns, with a line from its joint that shows the angle."""
    x, y = at[piece.joint]
    turned = f"translate({x} {y}) rotate({-math.degrees(piece.turns[pose]):.2f})"
    return (
        f'<g data-turns="{place}" data-at="{escape(piece.joint)}" transform="{turned}">'
        f'<polygon class="piece" points="{_outline(piece.points, frame)}"/>'
        f'<path class="key-way" d="M0 0L{_outline(piece.points[:1], frame)}"/></g>'
    )


def _link_data(first: str, second: str) -> str:
    return f'data-a="{escape(first)}" data-b="{escape(second)}"'


def _ground(x: float, y: float) -> str:
    """Sign of a fixed joint."""
    low = y + 1.4 * GROUND
    return f"M{x - GROUND} {low:.1f}L{x} {y}L{x + GROUND} {low:.1f}Z"


def _centre(joint: str, at: Mapping[str, Floats]) -> str:
    return f'data-at="{escape(joint)}" cx="{at[joint][0]}" cy="{at[joint][1]}"'


def _path(points: Floats) -> str:
    """Way of a joint over the turn, every second position."""
    coordinates = " ".join(f"{x:.0f},{y:.0f}" for x, y in points[::2].tolist())
    return f'<polygon class="way" points="{coordinates}"/>'


def _spring(first: Floats, second: Floats) -> str:
    """A spring's sign between two points; the script draws the same."""
    (x, y), (u, v) = first.tolist(), second.tolist()
    long = math.hypot(u - x, v - y) or 1.0
    nx, ny = -(v - y) / long * 12, (u - x) / long * 12
    commands = [f"M{x:.1f} {y:.1f}"]
    for k in range(1, 2 * COILS):
        share, side = k / (2 * COILS), (1 if k % 2 else -1)
        commands.append(f"L{x + share * (u - x) + side * nx:.1f} {y + share * (v - y) + side * ny:.1f}")
    return "".join([*commands, f"L{u:.1f} {v:.1f}"])
