"""Table with six digits in each cell, independent of the other cells."""

from collections.abc import Mapping, Sequence

import pandas as pd

from loomopt.picture.table import Column


class TableFrame(pd.DataFrame):
    """A pandas table as any other; shown cell by cell, so that one tiny or huge number leaves its column readable."""

    @property
    def _constructor(self) -> "type[TableFrame]":
        return TableFrame

    def __repr__(self) -> str:
        with pd.option_context("display.float_format", "{:.6g}".format):
            return super().__repr__()

    def _repr_html_(self) -> str | None:
        with pd.option_context("display.float_format", "{:.6g}".format):
            return super()._repr_html_()  # type: ignore[misc,no-any-return]


def frame(columns: Sequence[Column], attrs: Mapping[str, str], index: str | None = None) -> TableFrame:
    """Table of those columns that files have; attrs: where it comes from; index: the column that names the rows."""
    table = TableFrame({column.name: column.values for column in columns if column.name})
    table = table.astype({column.name: column.kind for column in columns if column.kind})
    table = table if index is None else table.set_index(index)
    table.attrs.update(attrs)
    return table
