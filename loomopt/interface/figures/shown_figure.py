"""A figure that shows itself in Jupyter, and whose texts stay clear of each other at any size it is given."""

from collections.abc import Callable
from io import BytesIO
from typing import Any

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Annotation, Text

DOTS = 110
"""Per inch of a figure on a page of a notebook."""
PADS: dict[str, Any] = {"w_pad": 0.06, "h_pad": 0.05}
"""Around axes, inches."""
TICK: dict[str, Any] = {"pad": 3.5, "length": 3.5, "labelsize": 9.0}
"""Of ticks and their numbers, pt."""
LABEL = 4.0
"""From the numbers of an axis to its name, pt."""


class ShownFigure(Figure):
    """A figure as any other of matplotlib's, but on a page smaller than it was made for texts shrink as the page does.

    made_for: the size of that page, inches; none until it is finished. written: functions of the scale that write what
    cannot be shrunk in place, such as legends.
    """

    made_for: tuple[float, float] | None = None
    scale = 1.0
    written: tuple[Callable[[float], Any], ...] = ()

    def laid_out(self) -> None:
        """Have matplotlib lay the figure out, at every size it is given."""
        self.set_layout_engine(ConstrainedLayoutEngine(**PADS))

    def write(self, write: Callable[[float], float]) -> float:
        """Write something now, and again whenever the scale changes; return its height as it returns it."""
        self.written = (*self.written, write)
        return write(self.scale)

    def finish(self, height: float) -> None:
        """Give the figure its height, inches: for this size its texts are made."""
        self.set_size_inches(self.get_figwidth(), height)
        self.made_for = self.get_figwidth(), height

    def set_size_inches(self, w: Any, h: Any = None, forward: bool = True) -> None:
        """Set the size, and texts as large as it has room for."""
        super().set_size_inches(w, h, forward)
        if self.made_for:
            pairs = zip(self.get_size_inches(), self.made_for, strict=True)
            scale = min(1.0, *(float(now / size) for now, size in pairs))
            if 0.0 < scale != self.scale:
                self._shrink(scale)

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=DOTS)
        return picture.getvalue()

    def _shrink(self, scale: float) -> None:
        """Scale all texts and the distances between them."""
        ratio, self.scale = scale / self.scale, scale
        engine = self.get_layout_engine()
        if isinstance(engine, ConstrainedLayoutEngine):
            engine.set(**{name: scale * size for name, size in PADS.items()})
        for text in self.findobj(Text):
            text.set_fontsize(float(text.get_fontsize()) * ratio)
            if isinstance(text, Annotation):
                x, y = map(float, text.xyann)
                text.xyann = ratio * x, ratio * y
        for axes in self.axes:
            for drawn_axes in (axes, *axes.child_axes):
                drawn_axes.tick_params(**{name: scale * size for name, size in TICK.items()})
                drawn_axes.xaxis.labelpad = drawn_axes.yaxis.labelpad = LABEL * scale
        for write in self.written:
            write(scale)
