"""The torque budget of a design to work with: a table, a figure, and how it shows itself in Jupyter."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base import arguments
from loomopt.scenes.designs import Design
from loomopt.scenes.scene import Scene
from loomopt.studies import budget

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from loomopt.interface.report.markup import Part


class Budget(budget.Found):
    """Where the crank torque of a design comes from, and what it asks of motor and flywheel; SI and rad."""

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per effect and one for their sum, units in the column names; si: in SI, else the scene's."""
        from loomopt.interface.text import budget as text

        return text.frame(self, arguments.flag(si, "si"))

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the shares over the turn, one upon the other; the figure shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import budget as figures

        place = None if path is None else Path(arguments.path(path, "path", *arguments.PICTURE))
        drawn: Figure = figures.plot(self, place)
        return drawn

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report import beside

        return beside.budget(self)

    def __repr__(self) -> str:
        size = self.scene.show(self.total.at_peak, "torque")
        return f"<Budget {self.scene.name}: crank torque {size} at its peak, of {len(self.rows)} effects>"

    def _repr_html_(self) -> str:
        from loomopt.interface.text import budget as text
        from loomopt.interface.text import notebook

        return notebook.page(text.parts(self))


def drawn_up(scene: Scene, design: Design, fluctuation: float | None = None) -> Budget:
    """Return the torque budget of a design, checked (SI; what it does not name is today's). Raises BadInput."""
    found = budget.drawn_up(scene, design, fluctuation)
    return Budget(found.scene, found.found, found.remarks, found.undefined)
