"""The one error a user can cause.

Text from outside is shortened, and stripped of whatever a terminal would obey.
"""

_LONGEST = {"file": 240, "key": 190, "problem": 480, "value": 120, "allowed": 480, "remedy": 240}
"""Characters of each part, so that a message is read."""


def clean(text: str, longest: int = 1000) -> str:
    """Return text without control characters, shortened to about `longest` characters."""
    ending = f"... ({len(text)} characters)" if len(text) > longest else ""
    kept = text[:longest]
    if not kept.isprintable():
        kept = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in kept)[:longest]
    return kept + ending


class BadInput(ValueError):  # noqa: N818 (it names what happened; users catch it by this name)
    """Input that cannot be worked with, as one plain message.

    file: where it stands; key: dotted path; value: as given; allowed: what may stand there; remedy: what to do.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str = "",
        key: str = "",
        value: str = "",
        allowed: str = "",
        remedy: str = "",
    ) -> None:
        self.problem, self.file, self.key = problem, file, key
        self.value, self.allowed, self.remedy = value, allowed, remedy
        parts = {"file": file, "key": key, "problem": problem, "value": value, "allowed": allowed, "remedy": remedy}
        file, key, problem, value, allowed, remedy = (clean(text, _LONGEST[name]) for name, text in parts.items())
        place = ": ".join(part for part in (file, key) if part)
        shown = f" (given: {value})" if value else ""
        sentences = [f"{problem}{shown}", f"Allowed: {allowed}" if allowed else "", remedy]
        text = " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)
        super().__init__(f"{place}: {text}" if place else text)
