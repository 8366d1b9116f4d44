"""The documentation site, as `make docs` builds it: whole, linked, self-contained, searched from the file system."""

import importlib.util
import os
import re
import subprocess
import sys
import time
from collections import defaultdict
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from support.browsers import browser

import loomopt as lo
from loomopt.interface.cli.app import COMMANDS

ROOT = Path(__file__).parents[2]
SITE = ROOT / "build" / "site"
FIRST = SITE / "docs" / "index.html"
BUILT = {"index.html", "genindex.html", "search.html"}
"""Pages of Sphinx's, beside those that are written."""
CLICKS = 3
REQUESTS = {
    ("script", "src"),
    ("link", "href"),
    ("img", "src"),
    ("iframe", "src"),
    ("source", "src"),
    ("object", "data"),
}
"""What a browser fetches by itself."""
OUTSIDE = re.compile(r"^(?:[a-z]+:)?//")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def built():
    """Build the site; what was built before and has not changed is kept."""
    if not all(map(importlib.util.find_spec, ("myst_nb", "pydata_sphinx_theme", "sphinx"))):
        pytest.skip("the extra docs is not installed: make docs")
    words = ["-m", "sphinx", "-W", "--keep-going", "-q", "-j", "2", "-c", "docs", ".", str(SITE)]
    nowhere = {f"{name}{end}": "http://127.0.0.1:9" for name in ("http", "https") for end in ("_proxy", "_PROXY")}
    done = subprocess.run(
        [sys.executable, *words], cwd=ROOT, capture_output=True, text=True, env={**os.environ, **nowhere}
    )
    assert done.returncode == 0, done.stderr


class Read(HTMLParser):
    """A page: where its links lead, what it asks for, its anchors, how many equations, its words."""

    def __init__(self, text):
        super().__init__()
        self.links, self.requests, self.anchors, self.equations, self.words = [], [], set(), 0, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        self.equations += tag == "math"
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        for name, key in REQUESTS:
            if tag == name and given.get(key) and given.get("rel") not in ("index", "search", "next", "prev"):
                self.requests.append(given[key])
        self.requests += re.findall(r"url\(([^)]+)\)", given.get("style") or "")
        if given.get("srcdoc"):
            inner = Read(given["srcdoc"])
            self.requests += inner.requests

    def handle_data(self, data):
        self.words.append(data)


@cache
def pages():
    """Return the pages by their place in the site."""
    result = (path for path in SITE.rglob("*.html") if "_static" not in path.parts)
    return {path.relative_to(SITE).as_posix(): Read(path.read_text(encoding="utf-8")) for path in result}


def inside(page, link):
    """Return where a link of a page leads in the site, and the anchor there."""
    target, _, anchor = link.partition("#")
    place = os.path.normpath(Path(page).parent / unquote(target.partition("?")[0])) if target else page
    return Path(place).as_posix(), anchor


def test_no_page_asks_for_anything_outside_the_site():
    assert len(pages()) > 35
    for page, read in pages().items():
        requests = [item for item in read.requests if not item.startswith("data:")]
        assert [item for item in requests if OUTSIDE.match(item)] == [], page
        assert [item for item in requests if not (SITE / inside(page, item)[0]).exists()] == [], page


def test_no_style_or_script_asks_for_anything_outside_the_site():
    styles = list(SITE.rglob("*.css"))
    assert styles
    for style in styles:
        text = re.sub(r"/\*.*?\*/", "", style.read_text(encoding="utf-8"), flags=re.DOTALL)
        named = re.findall(r"url\(\s*[\"']?([^\"')]+)", text) + re.findall(r"@import\s+[\"']([^\"']+)", text)
        assert [item for item in named if OUTSIDE.match(item)] == [], style.name
    for page, read in pages().items():
        assert "mathjax" not in " ".join(read.requests).lower(), page


def test_mathematics_is_mathml():
    assert sum(read.equations for read in pages().values()) > 200
    assert all(pages()[f"docs/theory/{job}.html"].equations > 20 for job in ("beatup", "rapier", "shedding"))


def test_every_link_leads_to_a_page_and_an_anchor_of_it():
    broken = defaultdict(list)
    for page, read in pages().items():
        for link in read.links:
            if not re.match(r"^[a-z]+:", link):
                place, anchor = inside(page, link)
                there = pages()[place].anchors | {""} if place in pages() else {anchor}
                if not (SITE / place).exists() or unquote(anchor) not in there:
                    broken[page].append(link)
    assert dict(broken) == {}


def test_every_page_is_reached_from_the_first_one_in_three_clicks():
    result = edge = {FIRST.relative_to(SITE).as_posix()}
    for _ in range(CLICKS):
        edge = {inside(page, link)[0] for page in edge for link in pages()[page].links} & pages().keys() - result
        result = result | edge
    assert pages().keys() - BUILT <= result


def test_no_page_names_a_path_of_this_machine():
    for path in SITE.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert str(ROOT) not in text, path
        assert "site-packages" not in text, path


def test_every_command_stands_in_the_reference_with_its_options():
    read = pages()["docs/reference/commands.html"]
    words = " ".join(read.words)
    assert set(COMMANDS) <= read.anchors
    assert all(option in words for option in ("--over", "--gap", "--fluctuation", "--samples", "--animate"))


@pytest.mark.parametrize("job", ["beatup", "rapier", "shedding"])
def test_every_equation_of_a_packaged_scene_stands_in_its_theory(job):
    words = "".join(pages()[f"docs/theory/{job}.html"].words)
    assert [equation.name for equation in lo.load(job).equations() if equation.name not in words] == []


@pytest.mark.parametrize("job", ["beatup", "rapier", "shedding"])
def test_every_key_of_a_scene_stands_in_its_reference(job):
    words = "".join(pages()[f"docs/reference/scene-{job}.html"].words)
    schema: Any = lo.schema(job)["properties"]
    keys = [*schema["operation"]["properties"], *schema["mechanism"]["properties"], *schema["limits"]["properties"]]
    assert [key for key in keys if key not in words] == []
    assert [name for name in schema["effects"]["properties"] if f"effects.{name}" not in words] == []


def test_in_a_browser_the_site_opens_moves_and_is_searched_from_the_file_system():
    with browser() as shown:
        shown.open(SITE / "index.html")
        time.sleep(1)
        assert shown.run("return location.href").endswith("docs/index.html")
        shown.driver.switch_to.frame(shown.one("iframe"))
        before = shown.one("input[type=range]").get_property("value")
        time.sleep(0.5)
        assert shown.one("input[type=range]").get_property("value") != before
        shown.driver.switch_to.default_content()
        shown.driver.get(f"{(SITE / 'search.html').as_uri()}?q=transmission+angle")
        deadline = time.monotonic() + 10
        while "finished" not in shown.one("#search-results").text and time.monotonic() < deadline:
            time.sleep(0.1)
        results = [item.get_attribute("href") for item in shown.all("#search-results a")]
        assert any("docs/ideas/index.html" in item for item in results)
        for page in ("docs/index", "docs/own-loom/beatup", "docs/theory/beatup", "docs/hard-cases", "notebooks/beatup"):
            shown.open(SITE / f"{page}.html", 400)
            wide = shown.run("return document.documentElement.scrollWidth")
            assert wide <= 400, page
        requests = [item for item in shown.requests if not item.startswith(("file:", "data:", "about:", "blob:"))]
        assert requests == []
        assert [item for item in shown.errors if "PST" not in item] == []
