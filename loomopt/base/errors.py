"""Error of bad input, and the error of another distribution's code.

Text from outside is shortened, and stripped of whatever a terminal would obey.
"""

import contextlib
import copy
import difflib
import itertools
import re
import traceback
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType

from loomopt.base.units import QuantityError

_LONGEST = {"file": 240, "key": 190, "problem": 480, "value": 120, "allowed": 480, "remedy": 240}
"""Characters of each part, so that a message is read."""
WHOLE, MACHINE, GAP, NAME, VALUE = range(5)
"""Grades of mistakes: it hides others, the machine cannot work, a value is missing, a name or a value is wrong."""
_MOST, _MOST_PRINTED = 100, 20
"""Number of mistakes after which reading stops; number of mistakes with a line of their own."""


def clean(text: str, longest: int = 1000) -> str:
    """Text without control characters, shortened to about `longest` characters."""
    ending = f"... ({len(text)} characters)" if len(text) > longest else ""
    head = text[:longest]
    if not head.isprintable():
        head = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in head)[:longest]
    return head + ending


class FormerNameWarning(FutureWarning):
    """A figure is called by its former name."""


class BadInput(ValueError):  # noqa: N818 (it names what happened; users catch it by this name)
    """Input that cannot be worked with, as one plain message.

    file: name of the file; key: dotted path; value: as given; allowed: allowed values; remedy: what to do;
    grade: how bad it is, 0 the worst. Of several mistakes the message has a line each, and all else is of the first.
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
        grade: int = VALUE,
    ) -> None:
        self.problem, self.file, self.key, self.grade = problem, file, key, grade
        self.value, self.allowed, self.remedy = value, allowed, remedy
        parts = {"file": file, "key": key, "problem": problem, "value": value, "allowed": allowed, "remedy": remedy}
        file, key, problem, value, allowed, remedy = (clean(text, _LONGEST[name]) for name, text in parts.items())
        place = ": ".join(part for part in (file, key) if part)
        shown = f" (given: {value})" if value else ""
        sentences = [f"{problem}{shown}", f"Allowed: {allowed}" if allowed else "", remedy]
        text = " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)
        self.line = self.text = f"{place}: {text}" if place else text
        self.others: tuple[BadInput, ...] = ()
        super().__init__(self.text)

    def __str__(self) -> str:
        return self.text

    def _render_traceback_(self) -> list[str]:
        """Lines that Jupyter and IPython show in place of a traceback: the message."""
        return [f"{type(self).__name__}: {self}"]

    @property
    def faults(self) -> "tuple[BadInput, ...]":
        """Mistakes as separate errors, the worst first."""
        return (self._in(self.file) if self.others else self, *self.others)

    def placed(self, file: str, tables: Collection[str]) -> "BadInput":
        """Same mistakes; those in one of these tables name this file if they name none."""
        first, *others = (
            fault._in(file) if not fault.file and fault.key.split(".")[0] in tables else fault for fault in self.faults
        )
        return first.together(others) if others else first

    def _in(self, file: str) -> "BadInput":
        """First mistake, with the name of a file."""
        more = {name: getattr(self, name) for name in ("key", "value", "allowed", "remedy", "grade")}
        return type(self)(self.problem, file=file, **more)

    def together(self, others: "Sequence[BadInput]") -> "BadInput":
        """Error with several mistakes, one line for each."""
        error = copy.copy(self)
        error.others = tuple(others)
        named, more = others[: _MOST_PRINTED - 1], len(others) - _MOST_PRINTED + 1
        rest = [f"and {more} more: correct these first"] if more > 0 else []
        error.text = "\n".join([*(fault.line for fault in (self, *named)), *rest])
        return error


class Faults:
    """Mistakes of an input: `with faults:` adds one and continues, `tell` raises all; file: name of the input."""

    def __init__(self, file: str = "") -> None:
        self.file = file
        self.mistakes: list[BadInput] = []

    def __enter__(self) -> "Faults":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> bool:
        if not isinstance(error, BadInput):
            return False
        self.add(error)
        return True

    def add(self, error: BadInput) -> None:
        """Add a mistake. Raises BadInput where there are too many."""
        self.mistakes += error.faults
        if len(self.mistakes) >= _MOST:
            self.tell()

    def within(self, *tables: str) -> bool:
        """Whether a mistake is in one of these tables."""
        return any(mistake.key.split(".")[0] in tables for mistake in self.mistakes)

    def error(self) -> BadInput:
        """Error of all mistakes, the worst first; there must be one."""
        first, *others = sorted(self.mistakes, key=lambda mistake: mistake.grade)
        return first.together(others) if others else first

    def tell(self) -> None:
        """Raise BadInput where there is any mistake."""
        if self.mistakes:
            raise self.error()


class Broken(BadInput):
    """The code of another distribution has failed."""


PLUGINS: dict[str, str] = {}
"""Module of an entry point → description and distribution, such as "effect beatup.wind of loomopt-wind"."""


def blamed(error: BaseException) -> BaseException:
    """Message for an error raised in the code of another distribution, with its name.

    Any other is returned as it is, with a note of what other distributions bring.
    """
    if isinstance(error, BadInput | KeyboardInterrupt | GeneratorExit) or not PLUGINS:
        return error
    message = " ".join(f"{type(error).__name__}: {error}".rstrip(": ").split())
    for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__"))
        owners = [name for name in PLUGINS if _is_of(module, name)]
        if owners:
            owner = module if module in owners else owners[0]
            where = f"{frame.f_code.co_name}, line {line} of {module}"
            return Broken(f"{PLUGINS[owner]} fails in {where}: {message}", remedy="Correct it, or remove it")
    note = f"other distributions take part: {', '.join(sorted(set(PLUGINS.values())))}"
    if note not in getattr(error, "__notes__", ()):
        error.add_note(note)
    return error


def _is_of(module: str, package_name: str) -> bool:
    """Whether a module is that of an entry point, or of the same package."""
    package = package_name.partition(".")[0]
    return module == package_name or (package != __name__.partition(".")[0] and module.partition(".")[0] == package)


@contextlib.contextmanager
def naming() -> Iterator[None]:
    """Context in which an error of another distribution's code is raised as Broken, with its name."""
    try:
        yield
    except BaseException as error:
        blame = blamed(error)
        if blame is error:
            raise
        raise blame from error


_LONGEST_VALUE, _LONGEST_PART = 80, 450
_MOST_FILES = 1000
"""Files of a folder that are looked through for one of a near name."""
NEAR, SAME = 0.5, 0.75
"""Share of equal letters of two names: for a possible match, and for a sure match."""
NOTHING = object()
"""Marker for a missing value: None is a value."""


def shown(value: object) -> str:
    """Raw value as text of a scene, shortened."""
    if isinstance(value, str):
        return f'"{clean(value, _LONGEST_VALUE)}"'
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > 256:
        return "a huge whole number"
    if isinstance(value, dict | list | tuple):
        return "a table" if isinstance(value, dict) else "a list" if value else "an empty list"
    return clean(str(value), _LONGEST_VALUE) if isinstance(value, int | float) else type(value).__name__


def refusal(
    problem: str,
    origin: str,
    key: str = "",
    value: object = NOTHING,
    allowed: str = "",
    remedy: str = "",
    grade: int = VALUE,
) -> BadInput:
    """Error for one problem; value: as the user wrote it, if any; grade: severity."""
    return BadInput(
        clean(problem, _LONGEST_PART),
        file=clean(origin, _LONGEST_PART),
        key=clean(key, 2 * _LONGEST_VALUE),
        value="" if value is NOTHING else shown(value),
        allowed=clean(allowed, _LONGEST_PART),
        remedy=clean(remedy, _LONGEST_PART),
        grade=grade,
    )


def unknown(
    noun: str,
    name: str,
    known: Iterable[str],
    origin: str,
    key: str,
    remedy: str = "Correct the name or take it out",
    given: Collection[str] = (),
) -> BadInput:
    """Error for an unknown name, with the nearest known one; noun: "key", "effect", …

    remedy: where none is near; given: names that are there too, and so are meant less likely.
    """
    names = list(known)
    near = nearest(name, names, given)
    remedy = f'Perhaps "{near}" is meant' if near else remedy
    grade = WHOLE if noun in ("table", "job", "effect", "target") else NAME
    allowed = ", ".join(names) or "none"
    return refusal(f"unknown {noun} {shown(name)}", origin, key, allowed=allowed, remedy=remedy, grade=grade)


def nearest(name: str, known: Iterable[str], given: Collection[str] = (), least: float = NEAR) -> str:
    """Nearest known name, ignoring case and hyphens; "" where none is near.

    given: names that come last among equally near ones; least: how alike names must be, 1 for the same letters.
    """
    plain, best = _plain(name[:_LONGEST_VALUE]), ("", 0.0)
    for candidate in sorted(known, key=lambda candidate: candidate in given):
        alike = difflib.SequenceMatcher(None, _plain(candidate), plain).ratio()
        if alike >= least and alike > best[1]:
            best = candidate, alike
    return best[0]


def _plain(name: str) -> str:
    return re.sub(r"[\s_-]+", "_", name).casefold()


def near_file(path: Path) -> str:
    """Path of an existing file with a name near that of a missing file in its folder; "" where none is near."""
    with contextlib.suppress(OSError, ValueError):
        entries = itertools.islice(path.parent.iterdir(), _MOST_FILES)
        names = [entry.name for entry in entries if entry.suffix == path.suffix and entry.is_file()]
        near = nearest(path.stem, [Path(name).stem for name in names], least=SAME)
        return str(path.with_name(near + path.suffix)) if near else ""
    return ""


def misread(error: QuantityError, origin: str, key: str, value: object) -> BadInput:
    """Error for a value that is not the expected quantity."""
    return refusal(error.problem, origin, key, value, error.allowed, error.remedy)
