"""Ctrl-C in the middle of a solve: at once, cleanly, and with nothing half-written."""

import os
import re
import signal
import subprocess
import sys
import textwrap

import pytest
from support import slow

import loomopt as lo
from loomopt.base import interrupts

HOOKED = """
import os, signal, sys
from loomopt.interface.cli import app as cli
from loomopt.solving import engine

genuine, hits = engine.solve, []

def hook(number):
    hits.append(number)
    if len(hits) == {at}:
        os.kill(os.getpid(), signal.SIGINT)

def solve(*arguments, **options):
    return genuine(*arguments, **{{**options, "on_iteration": hook}})

engine.solve = solve
sys.argv = ["loomopt", *sys.argv[1:]]
cli.main()
"""
"""The command as the shell starts it; Ctrl-C arrives at one iteration, so that it hits the solver itself."""


def interrupted(*arguments, at=3):
    code = textwrap.dedent(HOOKED).format(at=at)
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("at", [1, 5, 20])
@pytest.mark.parametrize("target", ["balance", "torque"])
def test_a_solve_stops_with_keyboard_interrupt(at, target):
    hits = []

    def hook(number):
        hits.append(number)
        if len(hits) == at:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        lo.solve(lo.load("beatup"), target, starts=50, on_iteration=hook)
    assert at <= len(hits) <= at + 2, "it stops where it is hit, not at the end of a start"


def test_a_solve_after_an_interrupted_one_is_as_good_as_ever():
    expected = lo.solve(lo.load("beatup"))
    with pytest.raises(KeyboardInterrupt):
        lo.solve(lo.load("beatup"), on_iteration=lambda _: os.kill(os.getpid(), signal.SIGINT))
    again = lo.solve(lo.load("beatup"))
    assert again.status == "optimal"
    assert again.design == expected.design


def test_a_hook_that_raises_stops_the_solve_too():
    def hook(number):
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        lo.solve(lo.load("beatup"), on_iteration=hook)


def test_a_hook_that_only_watches_changes_nothing():
    seen: list[int] = []
    watched = lo.solve(lo.load("beatup"), on_iteration=seen.append)
    assert len(seen) >= 10
    assert watched.design == lo.solve(lo.load("beatup")).design


@pytest.mark.few(1)
@pytest.mark.parametrize("options", [("--json",), ()], ids=["json", "table"])
def test_the_command_exits_130_and_prints_nothing_half(options):
    done = interrupted("solve", "beatup", *options)
    assert done.returncode == 130
    assert done.stdout == ""
    assert "stopped" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_the_folder_asked_for_holds_no_partial_files(tmp_path):
    folder = tmp_path / "answer"
    done = interrupted("solve", "beatup", "--out", str(folder))
    assert done.returncode == 130
    assert not folder.exists() or not list(folder.iterdir())


@pytest.mark.slow
def test_files_of_an_earlier_answer_stay_as_they_were(tmp_path):
    code = "from loomopt.interface.cli.app import main; main()"
    command = [sys.executable, "-c", code, "solve", "beatup", "--out", str(tmp_path)]
    subprocess.run(command, capture_output=True, check=True)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert before
    assert interrupted("solve", "beatup", "--set", "operation.M0=800 N*m", "--out", str(tmp_path)).returncode == 130
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_a_certificate_is_not_spoilt_by_a_late_interrupt():
    """Past the last iteration there is nothing to hit: the answer comes."""
    done = interrupted("solve", "beatup", "--json", at=100_000)
    assert done.returncode == 0
    assert '"status": "optimal"' in done.stdout


STOPPED_BY_THE_CLOCK = """
import os, signal, sys, threading
from loomopt.interface.cli import app as cli
from loomopt.solving.nlp import ipopt

genuine, begun = ipopt._no_warning_on_ctrl_c, []

def timed():
    if not begun:
        begun.append(1)
        threading.Timer({after}, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    return genuine()

ipopt._no_warning_on_ctrl_c = timed
sys.argv = ["loomopt", "solve", "rapier", "--starts", "300"]
cli.main()
"""
"""Ctrl-C arrives so many seconds after the first solve began, whether or not the solver is at work."""


@pytest.mark.slow
@pytest.mark.parametrize("after", slow.after(1, [0.3, 0.05, 0.7]))
def test_ctrl_c_is_told_in_one_line_without_the_solvers_own_warning(after):
    code = STOPPED_BY_THE_CLOCK.format(after=after)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (130, "")
    *progress, report = done.stderr.splitlines()
    assert report == "loomopt: stopped; nothing was left half-written."
    assert all(re.fullmatch(r"loomopt: .* \(\d+ s\)", line) for line in progress)


def test_an_interrupt_that_a_library_swallowed_is_found_after_the_solve(monkeypatch):
    monkeypatch.setattr(interrupts, "_came", [])
    interrupts.check()
    monkeypatch.setattr(interrupts, "_came", [signal.SIGINT])
    with pytest.raises(KeyboardInterrupt):
        interrupts.check()
    with pytest.raises(KeyboardInterrupt):
        lo.solve("beatup", starts=1)
