"""The finished study of what each effect is worth: as a table, a figure and JSON; it shows itself in Jupyter."""

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.design_study import who
from loomopt.studies.effects import worth
from loomopt.studies.effects.study import Effects
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class EffectsStudy(worth.Found):
    """What each effect of a scene is worth for a target; shares of natural sizes inside, units for a reader."""

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per effect, units in the column names; si: in SI, else in the scene's own units."""
        from loomopt.views import effects_table

        return effects_table.frame(self, si)

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the bars of shift and regret beside the tolerance; the figure shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.views import effects_figure

        drawn: Figure = effects_figure.plot(self, None if path is None else Path(path))
        return drawn

    def __repr__(self) -> str:
        left = ", ".join(self.left_out) or "nothing"
        return f"<EffectsStudy {self.scene.name}, {self.target}: at {100 * self.tolerance:g} % {left} may be left out>"

    def _repr_html_(self) -> str:
        from loomopt.views import effects_table, notebook

        return notebook.page(effects_table.parts(self, timed=False))


def concluded(study: Effects, rows: Sequence[Row]) -> EffectsStudy:
    """Return what rows of a study show, not all of which need be there. Raises BadInput where solve takes nothing."""
    found = worth.concluded(study, rows)
    return EffectsStudy(**{each.name: getattr(found, each.name) for each in fields(found)})


def conducted(
    study: Effects,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    on_row: run.OnRow | None = None,
) -> EffectsStudy:
    """Return a study after running it; count: of worker processes, where there is no executor.

    Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    return concluded(study, run.run(study, who(executor, count), None, on_row))
