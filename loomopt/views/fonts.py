"""Fonts for the characters of a text: matplotlib's own, and whatever the machine has for those it lacks."""

import functools

OWN, BOXES = "DejaVu Sans", "Last Resort High-Efficiency"
"""Fonts that come with matplotlib: the usual one, and one that has a box for every character."""


def families(text: str) -> list[str]:
    """Return the fonts to write a text in, the first that has a character first; what none has stays an empty box."""
    from matplotlib import font_manager

    lacking = {character for character in text if character.isprintable()} - _characters(font_manager.findfont(OWN))
    found = [OWN]
    if lacking:
        plain = (entry for entry in font_manager.fontManager.ttflist if entry.style == "normal" and entry.weight == 400)
        for name, path in sorted({(entry.name, entry.fname) for entry in plain if entry.name not in (OWN, BOXES)}):
            had = lacking & _characters(path)
            if had:
                found.append(name)
                lacking -= had
    return list(dict.fromkeys(found))


@functools.cache
def _characters(path: str) -> frozenset[str]:
    """Return the characters that a font file has; none where it cannot be read, or holds pictures of one size."""
    from matplotlib.ft2font import FT2Font

    try:
        font = FT2Font(path)
        return frozenset(map(chr, font.get_charmap())) if font.scalable else frozenset()
    except (OSError, RuntimeError):
        return frozenset()
