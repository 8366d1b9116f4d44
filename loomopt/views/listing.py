"""The packaged scenes for the terminal."""

from collections.abc import Iterable

from loomopt.scene.packaged import Head
from loomopt.views.layout import Grid


def grid(heads: Iterable[Head]) -> Grid:
    """Return title, targets and source of each scene."""
    lines: list[tuple[str, str]] = []
    for head in heads:
        lines += [
            (head.name, head.title),
            ("", f"job {head.job}; targets {', '.join(head.targets)}"),
            ("", f"source: {head.source or 'not given'}"),
        ]
    return Grid("", ("problem", "what it is"), tuple(lines))
