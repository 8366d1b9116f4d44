"""Searches on a toy: candidates as they are needed, and the exchange and the certificate as a test says."""

from dataclasses import replace
from typing import Any

import pytest
from support import toy

from loomopt.solving.certificate.certificate import Draft
from loomopt.solving.certificate.records import Certificate, Level
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import search as searching
from loomopt.solving.search.search import Candidate, Search

PROGRAM = toy.program("xy", {"f": lambda v: v["x"] ** 2, "g": lambda v: v["y"]}, objectives=("f", "g"))
LEVELS = (Level("f", 0.0, 0.0, 0.0), Level("g", 0.0, 0.0, 0.0))
GOOD = Certificate(True, (), LEVELS, 0.0, 0.0, True, True)
BAD = replace(GOOD, passed=False, reasons=("no",))


def candidate(*values, x=0.0, reached=True):
    point = Point({"x": x, "y": 0.0}, "Solve_Succeeded", reached)
    return Candidate(point, tuple(map(float, values)))


def empty(**more):
    return Search(toy.ToyJob(PROGRAM), PROGRAM, Settings(), **more)


@pytest.fixture
def certified(monkeypatch):
    """Return what is put before the certificate, and a way to say what it answers: by x, or for all."""
    seen, answers = [], dict[float | str, Any]()

    def begun(program, x, accuracy, shown):
        seen.append(x["x"])
        answer = answers.get(x["x"], answers.get("all", GOOD))
        certificate = answer(len(seen)) if callable(answer) else answer
        return Draft(lambda cycle: certificate)

    monkeypatch.setattr(searching, "draft_certificate", begun)
    return seen, answers


@pytest.fixture
def solved(monkeypatch):
    """Return the calls of the exchange, and the points it answers in order."""
    calls, points = [], list[Point]()

    def solve(program, start, settings, warm=None, known=None):
        calls.append((dict(start), settings.penalty, warm))
        return points.pop(0)

    monkeypatch.setattr(exchange, "solve", solve)
    return calls, points
