"""A table that a person reads: six digits in each cell, whatever stands in the others."""

import pandas as pd


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
