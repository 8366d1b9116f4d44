"""The one error a user can cause."""


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
        place = ": ".join(part for part in (file, key) if part)
        shown = f" (given: {value})" if value else ""
        sentences = [f"{problem}{shown}", f"Allowed: {allowed}" if allowed else "", remedy]
        text = " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)
        super().__init__(f"{place}: {text}" if place else text)
