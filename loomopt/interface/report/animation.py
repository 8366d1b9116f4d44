"""The mechanism moving by itself: as a page, in Jupyter, as a GIF, or as an MP4 where ffmpeg is found."""

import html
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.files import atomically, check, suffix
from loomopt.interface.files import outputs
from loomopt.interface.report import machine
from loomopt.interface.report.answer import Status
from loomopt.interface.report.markup import Markup, Part
from loomopt.interface.report.page import Chapter, page
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.picture.motion import MechanismMotion, crank_angles
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene
from loomopt.studies.run.rows import Row, SceneStudy

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

ENDINGS = (".html", ".gif", ".mp4")
FILE = "a path that ends in .html, .gif or .mp4", "Name a file, or leave it out"
"""Allowed files of an animation, and the remedy for others."""
EVERY, RATE = 3, 20
"""Poses per frame of a GIF or an MP4; frames per second."""
SIZE, FINE = 640, 2
"""Width of a frame, pixels; how many times finer it is drawn, so that lines are smooth."""
COLOURS = 32
"""Of a GIF: a few, with the shades between them and the paper."""
INK, GHOST, DESIGN, PIECE, PAPER = "#111827", "#9ca3af", "#1d4ed8", "#047857", "#ffffff"


@dataclass(frozen=True)
class MovingPicture:
    """A mechanism, or several stages of one, through the turn; in Jupyter it shows itself, with a slider.

    stages: description of each stage → its motion; ghost: machine that is drawn dashed behind it.
    """

    title: str
    angle: str
    unit: str
    stages: Mapping[str, MechanismMotion] = field(repr=False)
    ghost: MechanismMotion | None = field(default=None, repr=False)

    @property
    def widget(self) -> str:
        """The animation as markup."""
        labels = list(self.stages) if len(self.stages) > 1 else ()
        return machine.widget(list(self.stages.values()), self.ghost, self.angle, self.unit, 0, labels)

    @property
    def page(self) -> str:
        """The animation as a page."""
        part = Part("The mechanism through its turn", (Markup(self.widget),))
        return page([Chapter(self.title, "", Status("open", "Animation"), [part])])

    def _repr_html_(self) -> str:
        frame = html.escape(self.page, quote=True)
        title = html.escape(self.title)
        return f'<iframe srcdoc="{frame}" style="width:100%;height:720px;border:0" title="{title}"></iframe>'

    def save(self, path: Path) -> None:
        """Write the animation by the file's ending. Raises BadInput, also for an MP4 without ffmpeg."""
        WRITERS[suffix(path, ENDINGS)](self, path)


def check_file(path: Path) -> None:
    """Raise BadInput, before any computation, if no animation can be written to this file."""
    if suffix(path, ENDINGS) == ".mp4" and not shutil.which("ffmpeg"):
        remedy = "Install ffmpeg, or end the name in .gif or .html"
        raise refusal(
            "ffmpeg, which writes this format, is not installed",
            str(path),
            "--animate",
            ".mp4",
            ", ".join(ENDINGS),
            remedy,
        )
    check(path)


@working()
def animate(
    scene: Scene, design: Design, path: Path | None = None, subject: outputs.DrawnSubject | None = None
) -> MovingPicture:
    """Animation of a design's mechanism, with today's behind it. Raises BadInput.

    path: a file to write it to as well; subject: the design in words, for the title.
    """
    if path:
        check_file(path)
    job, full_design = registry.of(scene), flat(design)
    now, angles = job.today(scene), crank_angles()
    full = {**now, **full_design}
    moving = job.views.motion(scene, full, angles)
    if moving is None:
        keys = ", ".join(job.views.missing(scene))
        problem = "the mechanism cannot be drawn" if keys else f"job {scene.job} does not say how its mechanism moves"
        raise refusal(problem, scene.origin, keys, remedy="Give these" if keys else "Draw it still: --figure F.svg")
    ghost = None if full == now else machine.assemble(scene, now, angles)
    label = subject.text if subject else outputs.GIVEN if full_design and full != now else outputs.TODAY
    picture = MovingPicture(f"{scene.name}: {label}", job.views.angle, scene.shown_in("angle"), {label: moving}, ghost)
    if path:
        picture.save(path)
    return picture


@working()
def morph(study: SceneStudy, rows: Sequence[Row], path: Path | None = None) -> MovingPicture:
    """Animation through the certified designs of a study. Raises BadInput."""
    from loomopt.interface.report.study import stages

    if path:
        check_file(path)
    motions = stages(study, rows)
    if not motions:
        raise refusal("there is nothing to animate: no row is certified, or none can be drawn", "", "animate")
    view, title = registry.of(study.scene).views, f"{study.name} of {study.heading}"
    made = MovingPicture(title, view.angle, study.scene.shown_in("angle"), motions)
    if path:
        made.save(path)
    return made


def _page(picture: MovingPicture, path: Path) -> None:
    outputs.text(path, picture.page)


def _gif(picture: MovingPicture, path: Path) -> None:
    first, *others = frames(picture)
    from PIL.Image import Dither

    palette = first.quantize(COLOURS)
    rest = [image.quantize(COLOURS, palette=palette, dither=Dither.NONE) for image in others]

    def write(place: Path) -> None:
        palette.save(
            place, format="GIF", save_all=True, append_images=rest, duration=1000 // RATE, loop=0, optimize=False
        )

    atomically(path, write)


def _mp4(picture: MovingPicture, path: Path) -> None:
    """Write frames to a file by ffmpeg."""
    import subprocess

    check_file(path)
    images = list(frames(picture))
    width, height = images[0].size
    size = f"{width}x{height}"
    head = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(RATE)]
    tail = ["-i", "-", "-pix_fmt", "yuv420p", "-f", "mp4"]
    raw = b"".join(image.tobytes() for image in images)

    def write(place: Path) -> None:
        done = subprocess.run([*head, *tail, str(place)], input=raw, capture_output=True, check=False)
        if done.returncode:
            messages = done.stderr.decode(errors="replace").strip().splitlines()
            raise refusal(
                f"ffmpeg fails: {messages[-1] if messages else 'no message'}",
                str(path),
                "--animate",
                remedy="Write a .gif",
            )

    atomically(path, write)


WRITERS: dict[str, Callable[[MovingPicture, Path], None]] = {".html": _page, ".gif": _gif, ".mp4": _mp4}
"""Ending of a file → function that writes an animation."""


def frames(picture: MovingPicture) -> Iterator["Image"]:
    """Yield the frames of a turn; of several stages a turn each, one after the other."""
    motions = list(picture.stages.values())
    frame = machine.frame_of([*motions, *([picture.ghost] if picture.ghost else [])])
    for label, motion in picture.stages.items():
        for pose in range(0, len(motion.angles), EVERY if len(motions) == 1 else 3 * EVERY):
            layers = [(picture.ghost, True), (motion, False)]
            shown = [(layer, ghosted) for layer, ghosted in layers if layer is not None]
            yield _frame(shown, frame, pose, label if len(motions) > 1 else picture.title)


def _frame(layers: Sequence[tuple[MechanismMotion, bool]], frame: machine.Frame, pose: int, label: str) -> "Image":
    """One frame, drawn at a multiple of its size and reduced."""
    from PIL import Image, ImageDraw

    scale = FINE * SIZE / frame.width
    height = 2 * round(SIZE * frame.height / frame.width / 2)
    image = Image.new("RGB", (FINE * SIZE, FINE * height), PAPER)
    pen = ImageDraw.Draw(image)
    for motion, ghosted in layers:
        _draw(pen, motion, frame, pose, scale, ghosted)
    shown = image.reduce(FINE)
    ImageDraw.Draw(shown).text((8, 6), label, fill=INK)
    return shown


def _draw(
    pen: "ImageDraw", motion: MechanismMotion, frame: machine.Frame, pose: int, scale: float, ghosted: bool
) -> None:
    at = {name: tuple(scale * point for point in frame.at(np.asarray([p]))[0]) for name, p in motion.pivots.items()}
    at |= {
        name: tuple(scale * point for point in frame.at(points[pose : pose + 1])[0])
        for name, points in motion.joints.items()
    }
    link, piece, size = (GHOST, GHOST, scale * frame.size) if ghosted else (DESIGN, PIECE, scale * frame.size)
    for turning in motion.turning:
        (x, y), cos, sin = at[turning.joint], float(np.cos(turning.turns[pose])), float(np.sin(turning.turns[pose]))
        outline = [(x + size * (u * cos - v * sin), y - size * (u * sin + v * cos)) for u, v in turning.points]
        pen.line([*outline, outline[0]], fill=piece, width=2 * FINE)
        pen.line([(x, y), outline[0]], fill=piece, width=FINE)
    for joint, radius in motion.rings:
        (x, y), r = at[joint], size * radius
        pen.ellipse(
            (x - r, y - r, x + r, y + r), outline=GHOST if joint in motion.pivots or ghosted else piece, width=FINE
        )
    for first, second in (*motion.links, *motion.springs):
        thin = ghosted or (first, second) in motion.springs or (first in motion.pivots and second in motion.pivots)
        pen.line([at[first], at[second]], fill=GHOST if thin else link, width=FINE if thin else 4 * FINE)
    for name in at:
        if name not in motion.unnamed:
            (x, y), r = at[name], 3 * FINE
            pen.ellipse((x - r, y - r, x + r, y + r), fill=PAPER, outline=GHOST if ghosted else INK, width=FINE)
