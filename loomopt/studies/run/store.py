"""A durable store of studies in one SQLite file: each row in a transaction of its own, written by the driver alone.

Rollback journal and synchronous=FULL: a written row survives a crash, also of the machine; unlike a write-ahead log
both work on network file systems. One run at a time has the file to itself. Each row has a checksum: a file that was
changed since it was written is refused.
"""

import contextlib
import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any, TypeGuard

from loomopt.base import files
from loomopt.base.errors import BadInput, shown
from loomopt.studies.run.rows import Row

APPLICATION, VERSION = 0x6C6F6F6D, 2
"""What the file's head says: "loom", and the version of its tables."""
COLUMNS = tuple(column.name for column in fields(Row))
STATUSES = frozenset({"optimal", "infeasible", "uncertified", "failed", "interrupted"})
LARGEST_WHOLE = 2**53
"""Whole number that a float holds."""
STEPS = 1_000_000
"""Instructions of SQLite between two checks for Ctrl-C: some milliseconds."""
TABLES = {
    "study": "CREATE TABLE study (key TEXT PRIMARY KEY, told TEXT NOT NULL)",
    "row": f"CREATE TABLE row (study TEXT NOT NULL REFERENCES study (key), {', '.join(COLUMNS)},"
    " checksum TEXT NOT NULL, PRIMARY KEY (study, point))",
}
_REMEDY = "Name another file"


def _is_number(value: object) -> bool:
    """Whether a value is a number as rows have them."""
    return isinstance(value, float) or (_is_whole(value) and abs(value) <= LARGEST_WHOLE)


def _is_whole(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_place(value: object) -> bool:
    """Whether a value can be the number of a point."""
    return _is_whole(value) and 0 <= value <= LARGEST_WHOLE


def _is_text(value: object) -> bool:
    """Whether a value is text without characters that a terminal would obey."""
    return isinstance(value, str) and value.isprintable()


def _named(kind: Callable[[object], bool]) -> Callable[[object], bool]:
    """Test of a table whose values are of a kind."""
    return lambda value: isinstance(value, dict) and all(_is_text(name) and kind(item) for name, item in value.items())


KINDS: dict[str, Callable[[object], bool]] = {
    "point": _is_place,
    "place": _named(_is_number),
    "parent": lambda value: value is None or _is_place(value),
    "status": lambda value: isinstance(value, str) and value in STATUSES,
    "reason": lambda value: value is None or _is_text(value),
    "design": _named(_is_number),
    "figures": _named(lambda value: value is None or _is_number(value)),
    "multipliers": _named(_is_number),
    "reached": _named(lambda value: isinstance(value, bool)),
    "certified": lambda value: isinstance(value, bool),
    "seconds": _is_number,
    "warm": lambda value: isinstance(value, dict),
}
"""What a column must hold."""


class Store:
    """A file of studies; every column of a row is JSON text, its point apart, which is a number, and its checksum."""

    def __init__(self, path: Path) -> None:
        """Open the file, or make it. Raises BadInput if it is not a store, cannot be written, or is in use."""
        self.path = path
        files.check(path)
        with self._plain_errors():
            # An absolute path is never one of the names that keep nothing: ":memory:", "file:...".
            self._file = sqlite3.connect(path.absolute(), timeout=0.0, isolation_level=None, check_same_thread=False)
        try:
            with self._plain_errors():
                self._file.set_progress_handler(lambda: 0, STEPS)  # where Python sees to Ctrl-C
                for setting in ("locking_mode = EXCLUSIVE", "journal_mode = DELETE", "synchronous = FULL"):
                    self._file.execute(f"PRAGMA {setting}")
                with self._transaction():
                    self._begin()
        except BaseException:
            self._file.close()
            raise

    def _begin(self) -> None:
        """Make the tables in a new file, and check those of an old one."""
        head = tuple(self._file.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
        query = "SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"
        stored = dict(self._file.execute(query).fetchall())
        if head == (0, 0) and not stored:
            for table in TABLES.values():
                self._file.execute(table)
            self._file.execute(f"PRAGMA application_id = {APPLICATION}")
            self._file.execute(f"PRAGMA user_version = {VERSION}")
        elif head != (APPLICATION, VERSION):
            raise BadInput("the file is not a store of this version", file=str(self.path), key="store", remedy=_REMEDY)
        elif stored != TABLES:  # a view or a trigger would be run whenever a row is read or written
            names = sorted({*stored, *TABLES} - {name for name, table in TABLES.items() if stored.get(name) == table})
            problem = f"it has tables that no store has: {', '.join(names)}"
            raise BadInput(problem, file=str(self.path), key="store", remedy=_REMEDY)

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        self._file.execute("BEGIN EXCLUSIVE")
        try:
            yield
        except BaseException:
            self._file.execute("ROLLBACK")
            raise
        self._file.execute("COMMIT")

    @contextlib.contextmanager
    def _plain_errors(self) -> Iterator[None]:
        """Report SQLite's errors as plain messages."""
        try:
            yield
        except sqlite3.Error as error:
            if str(error) == "interrupted":
                raise KeyboardInterrupt from None
            busy = "locked" in str(error)
            problem = "another run has it open" if busy else f"it cannot be used as a store: {error}"
            remedy = "Wait for that run, or name another file" if busy else _REMEDY
            raise BadInput(problem, file=str(self.path), key="store", remedy=remedy) from None

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        self._file.close()

    def begin(self, key: str, description: Mapping[str, object]) -> None:
        """Enter a study, unless it is there; description: the content of its key, for readers of the file."""
        with self._plain_errors(), self._transaction():
            self._file.execute("INSERT OR IGNORE INTO study VALUES (?, ?)", (key, json.dumps(description)))

    def studies(self) -> dict[str, dict[str, Any]]:
        """Descriptions of all studies by key. Raises BadInput for a damaged one."""
        with self._plain_errors():
            records = self._file.execute("SELECT key, told FROM study ORDER BY rowid").fetchall()
        read = {key: _read_description(description) for key, description in records}
        if not all(read.values()):
            raise BadInput("its description of a study is damaged", file=str(self.path), key="store", remedy=_REMEDY)
        return read

    def rows(self, key: str) -> list[Row]:
        """Rows of a study. Raises BadInput for a damaged one."""
        with self._plain_errors():
            query = f"SELECT {', '.join(COLUMNS)}, checksum FROM row WHERE study = ? ORDER BY point"
            records = self._file.execute(query, (key,)).fetchall()
        return [self._row(key, cells) for cells in records]

    def _row(self, key: str, cells: Sequence[object]) -> Row:
        """Row of a study from its cells. Raises BadInput where they are not as they were written."""
        *values, checksum = cells
        record: dict[str, Any] = {}
        if checksum == _checksum(key, values):
            with contextlib.suppress(ValueError, RecursionError):
                record = {name: _read(cell) for name, cell in zip(COLUMNS, values, strict=True)}
        if not record or not all(holds(record[name]) for name, holds in KINDS.items()):
            problem = f"the row of point {shown(values[0])} is damaged"
            remedy = (
                f"{_REMEDY}, or take the row out (DELETE FROM row WHERE point = {shown(values[0])}): it is solved again"
            )
            raise BadInput(problem, file=str(self.path), key="store", remedy=remedy)
        return Row.from_dict(record)

    def add(self, key: str, row: Row) -> None:
        """Write a finished row; it is there for good when this returns."""
        values = [value if name == "point" else json.dumps(value) for name, value in row.as_dict().items()]
        marks = ", ".join("?" * (2 + len(COLUMNS)))
        with self._plain_errors(), self._transaction():
            self._file.execute(f"INSERT INTO row VALUES ({marks})", (key, *values, _checksum(key, values)))


def _read_description(text: object) -> dict[str, Any]:
    """Description of a study; {} if it was changed since it was written."""
    with contextlib.suppress(ValueError, RecursionError):
        content = json.loads(text) if isinstance(text, str) else {}
        return content if isinstance(content, dict) else {}
    return {}


def _checksum(key: str, cells: Sequence[object]) -> str:
    """Checksum of a row of a study, cell by cell, 64 hex digits."""
    return hashlib.sha256(repr((key, *cells)).encode(errors="surrogatepass")).hexdigest()


def _read(cell: object) -> object:
    return json.loads(cell) if isinstance(cell, str) else cell
