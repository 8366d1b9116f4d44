"""Notebooks run from a clean kernel, hold what they assert, and say what stands in them; nothing in them is local."""

import copy
import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOCATION = importlib.util.spec_from_file_location("loomopt_notebooks", ROOT / "notebooks" / "run.py")
run = importlib.util.module_from_spec(LOCATION)
sys.modules[LOCATION.name] = run
LOCATION.loader.exec_module(run)
STORED = {path.stem: run.read(path) for path in run.paths()}
LOCAL = re.compile(r"/(?:home|work|root|tmp|usr|Users)/|site-packages|0x[0-9a-f]{6}|\b20\d\d-\d\d-\d\d\b|\d s\b|Time:")


def test_there_is_one_for_each_job_and_one_on_accuracy():
    assert {"accuracy", "beatup", "rapier", "shedding"} <= set(STORED)


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_a_notebook_run_from_a_clean_kernel_says_what_stands_there(name):
    result = run.stored_run(ROOT / "notebooks" / f"{name}.ipynb")
    assert run.differences(STORED[name], result) == [], "make notebooks writes it anew"


@pytest.mark.parametrize("name", STORED)
def test_a_notebook_stands_there_as_it_was_run_from_top_to_bottom(name):
    code = [cell for cell in STORED[name].cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert len({cell.id for cell in STORED[name].cells}) == len(STORED[name].cells)
    kinds = {kind for cell in code for output in cell.outputs for kind in output.get("data", {})}
    assert {"image/png", "text/html"} <= kinds
    assert not [cell.id for cell in code for output in cell.outputs if output.output_type == "error"]


@pytest.mark.parametrize("name", STORED)
def test_a_notebook_holds_no_path_date_or_time_of_a_machine(name):
    for where, text in run.texts(STORED[name]):
        assert LOCAL.findall(text) == [], where
    assert [cell.id for cell in STORED[name].cells if cell.metadata] == []


@pytest.mark.parametrize("name", STORED)
def test_a_notebook_ends_in_assertions_on_references_with_the_relative_error_printed(name):
    *_, checks, last = STORED[name].cells
    assert checks.outputs[0].text.count("relative error") > 5
    lines = last.source.splitlines()
    assert len([line for line in lines if line.startswith("assert ")]) > 5
    assert last.outputs == []


@pytest.mark.parametrize(
    ("before", "after", "differ"),
    [
        ("peak 88.6894 N*m", "peak 88.6894 N*m", False),
        ("peak 88.6894 N*m", "peak 88.6893 N*m", False),
        ("peak 88.6894 N*m", "peak 88.6794 N*m", True),
        ("peak 88.6894 N*m", "peak -88.6894 N*m", True),
        ("peak 88.6894 N*m", "peaks 88.6894 N*m", True),
        ("limits 2e-16", "limits 7e-15", False),
        ("The only optimum reached by 15 solves", "The only optimum reached by 16 solves", False),
        ("relative error 2e-10", "relative error 2e-05", True),
        ("<td>1</td>", "<td>1</td><td>2</td>", True),
    ],
)
def test_other_numbers_and_other_words_are_found(before, after, differ):
    stored = copy.deepcopy(STORED["beatup"])
    stored.cells = [cell for cell in stored.cells if cell.cell_type == "code"][:1]
    result = copy.deepcopy(stored)
    for notebook, text in ((stored, before), (result, after)):
        notebook.cells[0].outputs = [{"output_type": "display_data", "data": {"text/html": text}, "metadata": {}}]
        notebook.cells[0].outputs = [run.nbformat.from_dict(output) for output in notebook.cells[0].outputs]
    assert bool(run.differences(stored, result)) == differ


def test_a_cell_or_a_picture_that_is_gone_is_found():
    stored = STORED["beatup"]
    fewer, blind = copy.deepcopy(stored), copy.deepcopy(stored)
    fewer.cells = [cell for cell in fewer.cells if cell.cell_type != "code" or "plot" not in cell.source]
    for cell in blind.cells:
        for output in cell.get("outputs", ()):
            output.get("data", {}).pop("image/png", None)
    assert run.differences(stored, fewer)
    assert run.differences(stored, blind)
