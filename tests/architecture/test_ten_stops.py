"""The page that walks one scene through the code: its files and functions are entered, in its order."""

import contextlib
import inspect
import io
import re
import sys
from pathlib import Path

import loomopt
from loomopt.interface.cli.app import run

PAGE = Path(__file__).parents[2] / "docs" / "development" / "walk.md"
PACKAGE = Path(loomopt.__file__).parent
STOP = re.compile(r"^\| (\d+) \| .* \| (.*) \| (.*) \|$", re.MULTILINE)


def entered(words):
    """Functions of the package that a command enters, by file and qualified name, in the order of their first call."""
    calls: dict[tuple[str, str], int] = {}

    def record(frame, event, _):
        code = frame.f_code
        is_function = code.co_flags & inspect.CO_OPTIMIZED  # a class body is entered when it is imported
        if event == "call" and is_function and code.co_filename.startswith(str(PACKAGE)):
            path = Path(code.co_filename).relative_to(PACKAGE).as_posix()
            calls.setdefault((path, code.co_qualname.split(".")[0]), len(calls))

    sys.setprofile(record)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            assert run(words) == 0
    finally:
        sys.setprofile(None)
    return calls


def test_the_stops_are_entered_in_the_order_of_the_page():
    calls = entered(["solve", "beatup", "--target", "balance"])
    stops = [
        (re.findall("`(.+?)`", files), re.findall("`(.+?)`", names))
        for _, files, names in STOP.findall(PAGE.read_text())
    ]
    assert len(stops) == 10
    first = []
    for files, names in stops:
        assert all(any(path == file for path, _ in calls) for file in files), files
        places = [calls[file, name] for file in files for name in names if (file, name) in calls]
        assert len(places) >= len(names), (files, names)
        first.append(min(places))
    assert first == sorted(first)
