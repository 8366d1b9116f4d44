"""A durable store of studies in one SQLite file: each row in a transaction of its own, written by the driver alone.

Rollback journal and synchronous=FULL: a row that was written is there after a crash, also of the machine; unlike a
write-ahead log both work on network file systems. One run at a time has the file to itself.
"""

import contextlib
import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import TracebackType

from loomopt.base import files
from loomopt.base.errors import BadInput
from loomopt.studies.run.rows import Row

APPLICATION, VERSION = 0x6C6F6F6D, 1
"""What the file's head says: "loom", and the version of its tables."""
COLUMNS = tuple(each.name for each in fields(Row))
OBJECTS = "place", "design", "figures", "multipliers", "reached", "warm"
KINDS: dict[str, type] = {"status": str, "certified": bool, **dict.fromkeys(OBJECTS, dict)}
"""What a column's JSON text must hold."""
TABLES = (
    "CREATE TABLE study (key TEXT PRIMARY KEY, told TEXT NOT NULL)",
    f"CREATE TABLE row (study TEXT NOT NULL REFERENCES study (key), {', '.join(COLUMNS)}, PRIMARY KEY (study, point))",
)
_OTHER = "Name another file"


class Store:
    """A file of studies; every column of a row is JSON text, its point apart, which is a number."""

    def __init__(self, path: Path) -> None:
        """Open the file, or make it. Raises BadInput where it is none of a study, cannot be written, or is in use."""
        self.path = path
        files.check(path)
        with self._told():
            self._file = sqlite3.connect(path, timeout=0.0, isolation_level=None, check_same_thread=False)
            for setting in ("locking_mode = EXCLUSIVE", "journal_mode = DELETE", "synchronous = FULL"):
                self._file.execute(f"PRAGMA {setting}")
            with self._transaction():
                self._begin()

    def _begin(self) -> None:
        """Make the tables in a new file, and check those of an old one."""
        head = tuple(self._file.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
        if head == (0, 0) and not self._file.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            for table in TABLES:
                self._file.execute(table)
            self._file.execute(f"PRAGMA application_id = {APPLICATION}")
            self._file.execute(f"PRAGMA user_version = {VERSION}")
        elif head != (APPLICATION, VERSION):
            raise BadInput("the file is no store of this version", file=str(self.path), key="store", remedy=_OTHER)

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
    def _told(self) -> Iterator[None]:
        """Tell what SQLite says as one plain message."""
        try:
            yield
        except sqlite3.Error as error:
            busy = "locked" in str(error)
            problem = "another run has it open" if busy else f"it cannot be used as a store: {error}"
            remedy = "Wait for that run, or name another file" if busy else _OTHER
            raise BadInput(problem, file=str(self.path), key="store", remedy=remedy) from None

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        self._file.close()

    def begin(self, key: str, told: Mapping[str, object]) -> None:
        """Enter a study, if it is not there yet; told: what its key is made of, for whoever reads the file."""
        with self._told(), self._transaction():
            self._file.execute("INSERT OR IGNORE INTO study VALUES (?, ?)", (key, json.dumps(told)))

    def rows(self, key: str) -> list[Row]:
        """Return the rows of a study that are there. Raises BadInput for one that was damaged."""
        with self._told():
            names = ", ".join(COLUMNS)
            found = self._file.execute(f"SELECT {names} FROM row WHERE study = ? ORDER BY point", (key,)).fetchall()
        return [self._row(cells) for cells in found]

    def _row(self, cells: Sequence[object]) -> Row:
        try:
            known = {name: _read(cell) for name, cell in zip(COLUMNS, cells, strict=True)}
        except ValueError:
            known = {}
        if not all(isinstance(known.get(name), kind) for name, kind in KINDS.items()):
            problem = f"the row of point {cells[0]} is damaged"
            raise BadInput(problem, file=str(self.path), key="store", remedy=_OTHER)
        return Row.from_dict(known)

    def add(self, key: str, row: Row) -> None:
        """Write a finished row; it is there for good when this returns."""
        values = [value if name == "point" else json.dumps(value) for name, value in row.as_dict().items()]
        marks = ", ".join("?" * (1 + len(COLUMNS)))
        with self._told(), self._transaction():
            self._file.execute(f"INSERT INTO row VALUES ({marks})", (key, *values))


def _read(cell: object) -> object:
    return json.loads(cell) if isinstance(cell, str) else cell
