"""An answer in Jupyter: well-formed HTML with a table and a drawing, text from outside harmless."""

import dataclasses
from xml.etree import ElementTree

import pytest

import loomopt as lo
from loomopt.interface.text import notebook
from loomopt.picture.table import TextTable
from loomopt.solving.answer.solution import Sentences

EVIL = 'A "loom" <script>alert(1)</script> & more'


@pytest.fixture(scope="module")
def answer():
    return lo.solve(lo.load("beatup-light"))


def tree(html):
    return ElementTree.fromstring(html.replace("&nbsp;", " "))


def test_an_answer_shows_sentence_table_prices_certificate_and_drawing(answer):
    result = tree(answer._repr_html_())
    words = "".join(result.itertext())
    tables = result.findall("table")
    heads = [None, "today", "design", "unit", "limits", "binds", "reached"]
    assert [cell.text for cell in tables[0].iter("th")] == heads
    cells = [[cell.text for cell in line] for line in tables[0].iter("tr")]
    lines = [[(cell or "").replace("\xa0", " ") for cell in line] for line in cells]
    assert ["l1", "31", "30", "mm", "30 ... 35", "min", ""] in lines
    assert tables[1].find("caption").text == "Binding limits and their prices"
    assert all(price.reading in words for price in answer.binding)
    assert "Certificate passed" in words
    assert len(result.findall("{http://www.w3.org/2000/svg}svg")) == 1


def test_text_from_outside_is_escaped(answer):
    certificate = dataclasses.replace(answer.certificate, passed=False, reasons=(EVIL,))
    evil = dataclasses.replace(
        answer.result, status="failed", sentences=Sentences(EVIL), problem=EVIL, certificate=certificate
    )
    html = notebook.html(evil)
    assert "<script" not in html
    assert EVIL in "".join(tree(html).itertext())
    assert "<script" not in notebook.table(TextTable(EVIL, (EVIL,), ((EVIL,),)))


@pytest.mark.slow
def test_an_infeasible_answer_shows_what_helps():
    infeasible = lo.solve(lo.load("beatup-light"), "retrofit")
    words = "".join(tree(infeasible._repr_html_()).itertext()).replace("\xa0", " ")
    assert "No admissible design exists" in words
    assert all(relaxation.text in words for relaxation in infeasible.relaxation)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_a_drawing_fits_a_page_whatever_the_machines_size(name):
    evaluation = lo.evaluate(name)
    drawn = evaluation.draw()
    root, full = (ElementTree.fromstring(text) for text in (drawn._repr_svg_(), drawn.svg))
    width, height = float(root.get("width")), float(root.get("height"))
    assert max(width, height) == notebook.PAGE
    sides = [float(side) for side in root.get("viewBox").split()[2:]]
    assert width / height == pytest.approx(sides[0] / sides[1], rel=2e-3)
    assert full.get("width") == f"{sides[0]:.12g}mm"
    assert evaluation._repr_html_().endswith(f"{drawn._repr_svg_()}</div>")
