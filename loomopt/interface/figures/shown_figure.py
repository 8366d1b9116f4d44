"""A figure that shows itself in Jupyter, whether or not pyplot has been set up there."""

from io import BytesIO

from matplotlib.figure import Figure

DOTS = 110
"""Per inch of a figure on a page of a notebook."""


class ShownFigure(Figure):
    """A figure as any other of matplotlib's."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=DOTS)
        return picture.getvalue()
