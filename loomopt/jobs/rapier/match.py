"""The table a head's travel should match: read from a CSV file beside the scene."""

from typing import Any

from loomopt import scene_csv as csv_table
from loomopt.scene_errors import refusal

KINDS = {"phi1": "angle", "S": "length"}


def read(scene: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return crank angles, rad, and head travels, m, of `targets.match.table`. Raises BadInput."""
    given = scene.targets["match"].table
    key = "targets.match.table"
    if given is None:
        remedy = f'Write table = "s.csv" in [targets.match]; the file has the columns {csv_table.header(KINDS)}'
        raise refusal("target match needs a table of head travel", scene.origin, key, remedy=remedy)
    (angles, travels), _ = csv_table.read(scene, given, key, KINDS)
    return angles, travels
