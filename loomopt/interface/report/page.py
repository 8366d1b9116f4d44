"""Page as a single file that contains its style and its script."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from html import escape

from loomopt.base import __version__
from loomopt.interface.report import report_path
from loomopt.interface.report.answer import Status
from loomopt.interface.report.markup import Part, part, text


@dataclass(frozen=True)
class Chapter:
    """Answer or study of a page: heading, status, parts; source: its origin."""

    heading: str
    title: str
    status: Status
    parts: Sequence[Part]
    source: str = ""


def page(chapters: Sequence[Chapter]) -> str:
    """Page of chapters, which begin with their status."""
    title = "; ".join(f"{chapter.status.verdict}: {chapter.heading}" for chapter in chapters)
    toc = _contents(chapters) if len(chapters) > 1 else ""
    body = "".join(_chapter(place, chapter) for place, chapter in enumerate(chapters, 1))
    made = f"Made by loomopt {__version__}, {date.today().isoformat()}. The page is self-contained."
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{_asset('report.css')}</style></head>\n"
        f"<body><main>{toc}{body}</main><footer><p>{text(made)}</p></footer><script>{_asset('report.js')}</script></body></html>\n"
    )


def _contents(chapters: Sequence[Chapter]) -> str:
    rows = "".join(
        f'<li class="{chapter.status.level}"><a href="#c{place}">{text(chapter.heading)}</a>: '
        f"{text(chapter.status.verdict)}</li>"
        for place, chapter in enumerate(chapters, 1)
    )
    return f"<nav><h1>{len(chapters)} reports</h1><ul>{rows}</ul></nav>"


def _chapter(place: int, shown: Chapter) -> str:
    sentences = "".join(f"<p>{text(sentence)}</p>" for sentence in shown.status.sentences)
    sub = "".join(f"<p>{text(line)}</p>" for line in (shown.title, shown.source) if line)
    return (
        f'<article id="c{place}"><header class="status {shown.status.level}">'
        f'<p class="verdict">{text(shown.status.verdict)}</p><h2>{text(shown.heading)}</h2>{sentences}</header>'
        f'<div class="source">{sub}</div>{"".join(map(part, shown.parts))}</article>'
    )


@functools.cache
def _asset(name: str) -> str:
    return report_path(name).read_text(encoding="utf-8").strip()
