"""The loom jobs by name, and the way from a file or a dict to a scene of one of them."""

import os
from collections.abc import Mapping
from typing import Any

from loomopt import packaged
from loomopt.jobs.beatup import scene as beatup_tables
from loomopt.jobs.rapier import scene as rapier_tables
from loomopt.jobs.shedding import scene as shedding_tables
from loomopt.scene_document import read_document
from loomopt.scenes import Scene, build
from loomopt.schema import Job

JOBS: dict[str, Job] = {job.name: job for job in (beatup_tables.SCHEMA, rapier_tables.SCHEMA, shedding_tables.SCHEMA)}
"""Every job a scene can name."""


def load(name_or_path: str | os.PathLike[str]) -> Scene:
    """Return the scene of a packaged name or of a TOML file. Raises BadInput."""
    path = packaged.locate(name_or_path)
    given = os.fspath(name_or_path)
    return build(read_document(path), JOBS, path.name if path.stem == given else given)


def scene(document: Mapping[str, Any]) -> Scene:
    """Return the scene that nested tables describe, as a TOML file would. Raises BadInput."""
    return build(document, JOBS, "<dict>")
