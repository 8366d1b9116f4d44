"""The pages in a real browser: they move, nothing overlaps at any width, nothing is asked for, paper cuts no table."""

import re
import time

import pytest
from support.browsers import browser

import loomopt as lo
from loomopt.interface.files import store_file
from loomopt.interface.report import document

pytestmark = pytest.mark.slow
PAGES = ("beatup", "rapier", "shedding", "infeasible", "front")
WIDTHS, SCHEMES = (1400, 400), ("light", "dark")
CLASH = {"bounds.l2.min": "60 mm", "bounds.l2.max": "61 mm", "bounds.l3.max": "141 mm", "limits.mu_min.min": "80 deg"}
SPOTS = """
const shown = e => { const b = e.getBoundingClientRect(); return b.width > 1 && b.height > 1 };
const inside = [...document.querySelectorAll(
  'h1,h2,h3,h4,p,table,figcaption,.chart>svg,.machine>svg,.controls>*,.key,li,.equation,.sheet svg')].filter(shown);
const boxes = inside.map(e => [e, e.getBoundingClientRect()]);
const found = [];
for (let i = 0; i < boxes.length; i++) for (let j = i + 1; j < boxes.length; j++) {
  const [a, p] = boxes[i], [b, q] = boxes[j];
  if (a.contains(b) || b.contains(a)) continue;
  const x = Math.min(p.right, q.right) - Math.max(p.left, q.left);
  const y = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
  if (x > 1 && y > 1) found.push([a.outerHTML.slice(0, 90), b.outerHTML.slice(0, 90), x, y]);
}
return found;
"""
LETTERS = """
const found = [];
document.querySelectorAll('svg').forEach(svg => {
  const boxes = [...svg.querySelectorAll('text')].map(t => [t.textContent, t.getBoundingClientRect()])
    .filter(([, b]) => b.width > 0);
  for (let i = 0; i < boxes.length; i++) for (let j = i + 1; j < boxes.length; j++) {
    const [a, p] = boxes[i], [b, q] = boxes[j];
    const x = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const y = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (x > 1 && y > 0.35 * Math.min(p.height, q.height)) found.push([a, b, x, y]);
  }
});
return found;
"""
RIGHT = """
return [...document.querySelectorAll('table,math,svg')].map(
  e => [e.getBoundingClientRect().right, e.outerHTML.slice(0, 80)]);
"""


@pytest.fixture(scope="module")
def shown():
    with browser() as made:
        yield made


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    for name in PAGES[:3]:
        second_answer = lo.solve(name, starts=None if name == "rapier" else 2)
        static = "shedding-static"
        neighbour = [second_answer.budget(), lo.sensitivity(static), lo.effects(static)] if name == "shedding" else []
        second_answer.report(folder / f"{name}.html", *neighbour)
    answer = lo.solve(lo.load("beatup").update(CLASH))
    assert answer.status == "infeasible"
    answer.report(folder / "infeasible.html")
    lo.pareto("beatup", ("peak_torque", "m4e"), points=12, store=folder / "front.db")
    (front,) = store_file.read_studies(folder / "front.db")
    document.write(folder / "front.html", [document.of_study(front.study, front.solved)])
    return {name: folder / f"{name}.html" for name in PAGES}


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", PAGES)
def test_nothing_overlaps_and_nothing_is_asked_for(shown, pages, name, width, scheme):
    shown.open(pages[name], width, scheme)
    assert shown.errors == []
    assert [request for request in shown.requests if not request.startswith(("file:", "data:"))] == []
    assert len([request for request in shown.requests if request.startswith("file:")]) <= 1
    assert shown.run("return document.documentElement.scrollWidth") <= width
    assert shown.run(SPOTS) == []
    assert shown.run(LETTERS) == []


@pytest.mark.parametrize("name", PAGES)
def test_ink_stands_out_from_its_page(shown, pages, name):
    for scheme in SCHEMES:
        shown.open(pages[name], 1400, scheme)
        ink, page = (
            [int(item) for item in re.findall(r"\d+", shown.run(f"return getComputedStyle(document.body).{key}"))[:3]]
            for key in ("color", "backgroundColor")
        )
        assert abs(sum(ink) - sum(page)) > 500, scheme
        assert (sum(page) > 600) == (scheme == "light")


def poses(shown):
    return shown.run("return document.querySelector('g.design').innerHTML")


@pytest.mark.parametrize("name", PAGES)
def test_slider_keys_and_play_move_the_mechanism_and_the_cursor(shown, pages, name):
    shown.open(pages[name])
    slide = "const s = document.querySelector('.turn'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))"
    shown.run(slide, 20)
    first, angle = poses(shown), shown.one(".angle").text
    assert angle.endswith("= 40 deg")
    shown.run(slide, 65)
    assert poses(shown) != first
    assert shown.one(".angle").text.endswith("= 130 deg")
    cursors = shown.run("return [...document.querySelectorAll('.cursor')].map(c => c.getAttribute('d'))")
    assert len(set(cursors)) <= 2
    assert (name == "front") == (cursors == [])
    shown.run("document.querySelector('.machine').focus()")
    for key, at in (("\ue014", 132), ("\ue012", 130), ("\ue013", 132), ("\ue015", 130)):
        shown.driver.switch_to.active_element.send_keys(key)
        assert shown.one(".angle").text.endswith(f"= {at} deg")
    play = shown.one(".play")
    for press in (play.click, lambda: shown.driver.switch_to.active_element.send_keys(" ")):
        before = poses(shown)
        shown.run("document.querySelector('.machine').focus()")
        press()
        time.sleep(0.4)
        moved = poses(shown)
        assert moved != before
        play.click()
        still = poses(shown)
        time.sleep(0.2)
        assert poses(shown) == still
    assert shown.errors == []


def test_the_cursor_reads_what_the_curve_says(shown, pages):
    shown.open(pages["beatup"])
    slide = "const s = document.querySelector('.turn'); s.value = 90; s.dispatchEvent(new Event('input'))"
    shown.run(slide)
    chart = next(item for item in shown.all(".chart") if "transmission angle" in item.text)
    read = float(chart.find_element("css selector", ".told").text)
    message = float(re.search(r"● ?least ([\d.]+)|least ([\d.]+) deg", chart.text).groups()[-1])
    assert read == pytest.approx(message, rel=2e-3)  # it is least at 180 deg; a curve is drawn in tenths of a pixel


def test_the_second_slider_goes_along_a_front(shown, pages):
    shown.open(pages["front"])
    slide = "const s = document.querySelector('.which'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))"
    texts = []
    for place in (0, 5, 11):
        shown.run(slide, place)
        texts.append((poses(shown), shown.one(".which + output").text))
    assert len(set(texts)) == 3
    assert all("peak_torque" in words for _, words in texts)


@pytest.mark.parametrize("name", PAGES)
def test_paper_cuts_no_table(shown, pages, name):
    shown.open(pages[name])
    # As wide as A4 less its margins, in the style of paper: nothing may stand out to the right.
    shown.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    size = {"width": 703, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    shown.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    assert [report for right, report in shown.run(RIGHT) if right > 704] == []
    cut = "return getComputedStyle(document.querySelector('tr')).breakInside"
    assert shown.run(cut) == "avoid"
    shown.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    paper = shown.printed()
    assert paper.startswith(b"%PDF")
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 12
