"""Reader of the studies in a store, with their rows as they were written."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput, refusal
from loomopt.base.units import factor
from loomopt.interface.study.points import StudyTable
from loomopt.jobs.registry import REGISTERED
from loomopt.scenes.document import Paths
from loomopt.scenes.numbers import quantity
from loomopt.scenes.scene import Scene, build
from loomopt.studies.front import front
from loomopt.studies.run.rows import SceneStudy
from loomopt.studies.run.store import Store
from loomopt.studies.sweep import plan_sweep

HEAD = b"SQLite format 3\x00"


def is_store(path: Path) -> bool:
    """Whether a file is an SQLite database, as a store is."""
    try:
        with path.open("rb") as file:
            return file.read(len(HEAD)) == HEAD
    except OSError:
        return False


def read_studies(path: Path) -> list[StudyTable]:
    """Every study of a store with the rows that are there, in the order of their start. Raises BadInput.

    Scrambles of a tolerance study are not designs and are left out.
    """
    with Store(path) as store:
        studies = {key: (about, tuple(store.rows(key))) for key, about in store.studies().items()}
    tables = [
        StudyTable(_study(about, path), rows) for about, rows in studies.values() if rows and "samples" not in about
    ]
    if not tables and any(rows for _, rows in studies.values()):
        problem = "the store holds a tolerance study, which has no designs"
        raise refusal(problem, str(path), "store", remedy="Give the design's answer and --study tolerance")
    if not tables:
        raise refusal("the store holds no row yet", str(path), "store", remedy="Run its study first")
    return tables


def _study(record: Mapping[str, Any], path: Path) -> SceneStudy:
    """Plan of a study in a store. Raises BadInput."""
    try:
        paths = Paths(path.absolute().parent, texts=dict(record["files"]))
        scene = build(record["document"], REGISTERED, str(path), paths)
        if "axes" in record:
            return _front(record, scene)
        return plan_sweep(
            scene, _over(record, scene), record["target"], accuracy=record["accuracy"], seed=record["seed"]
        )
    except BadInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError):
        raise refusal(
            "its description of a study is damaged", str(path), "store", remedy="Run the study again"
        ) from None


def _front(record: Mapping[str, Any], scene: Scene) -> SceneStudy:
    senses: Mapping[str, str] = record["axes"]
    named = {sense: [name for name, name_sense in senses.items() if name_sense == sense] for sense in ("least", "most")}
    return front.trade(
        scene,
        tuple(senses),
        record["target"],
        maximise=named["most"],
        minimise=named["least"],
        ranges={name: (float(low), float(high)) for name, (low, high) in record["ranges"].items()},
        points=record["points"],
        accuracy=record["accuracy"],
    )


def _over(record: Mapping[str, Any], scene: Scene) -> dict[str, list[str | float]]:
    """Key → its values as a scene gives them, in the unit in which that shows them."""
    texts: dict[str, list[str | float]] = {}
    for key, values in record["over"]:
        unit = record["units"][quantity(scene, key).kind]
        texts[key] = [value if unit == "1" else f"{value / factor(unit):.15g} {unit}" for value in values]
    return texts
