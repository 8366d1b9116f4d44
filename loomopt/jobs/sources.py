"""The figures that the source of a job's scenes prints, beside what this program computes from the same inputs.

They stand in the job's own folder, sources.csv: the citation in its first line, then a row per figure. The suite
computes every one of them again.
"""

import csv
from typing import NamedTuple

from loomopt.base.errors import BadInput
from loomopt.jobs import registry


class Printed(NamedTuple):
    """One printed figure: what is computed from which inputs, in which unit; "reproduces" or else why it does not."""

    key: str
    item: str
    inputs: str
    unit: str
    printed: str
    computed: str
    verdict: str
    remark: str


class Source(NamedTuple):
    """A source and the figures it prints."""

    citation: str
    figures: tuple[Printed, ...]


def read(job: str) -> Source:
    """Return the source of a job's scenes. Raises BadInput where the job names none."""
    place = registry.find(job).resources / "sources.csv"
    if not place.is_file():
        remedy = "Where a scene's numbers come from stands in its file: see `loomopt show`"
        raise BadInput(f"job {job} brings no printed figures", key="--sources", remedy=remedy)
    first, _, rest = place.read_text(encoding="utf-8").partition("\n")
    return Source(first.removeprefix("# "), tuple(Printed(**row) for row in csv.DictReader(rest.splitlines())))
