"""Progress that comes of itself: a line that is taken back on a terminal and in Jupyter, lines that stay in a pipe."""

import os
import pty
import subprocess
import sys
import textwrap
import time

import nbformat
import pytest
from nbclient import NotebookClient

from loomopt.interface import progress as module

CLEARED = "\x1b[K"
INTERVAL = module.LINE_INTERVAL


class Terminal:
    """A pseudo-terminal in place of stderr."""

    def __init__(self, monkeypatch):
        self.ours, theirs = pty.openpty()
        os.set_blocking(self.ours, False)
        monkeypatch.setattr(sys, "stderr", os.fdopen(theirs, "w"))

    def shown(self, patience=5.0):
        """Return what it shows next, up to the end of a line of progress; nothing once patience is over."""
        text, end = "", time.monotonic() + patience
        while time.monotonic() < end and not text.endswith(CLEARED):
            try:
                text += os.read(self.ours, 1).decode()
            except BlockingIOError:
                time.sleep(0.01)
        return text


def test_a_step_that_began_early_says_so_while_it_lasts(monkeypatch):
    terminal = Terminal(monkeypatch)
    monkeypatch.setattr(module, "FIRST_PAUSE", 0.05)
    with module.Progress() as progress:
        progress.say("building the law")
        assert terminal.shown() == "\rbuilding the law\x1b[K", "though nothing was said after the first second"
        progress.say("start 3 of 8")
        assert terminal.shown() == "\rstart 3 of 8\x1b[K"
    assert terminal.shown() == "\r\x1b[K"


def test_what_takes_no_longer_than_a_second_says_nothing_not_even_later(monkeypatch):
    terminal = Terminal(monkeypatch)
    monkeypatch.setattr(module, "FIRST_PAUSE", 0.05)
    with module.Progress() as progress:
        progress.say("proving")
    assert terminal.shown(patience=0.3) == ""


def test_a_line_longer_than_the_terminal_is_cut_so_that_it_can_be_taken_back(monkeypatch):
    terminal = Terminal(monkeypatch)
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(module, "FIRST_PAUSE", 0.0)
    with module.Progress() as progress:
        progress.say("long " * 100)
        text = terminal.shown()
    assert text == "\r" + ("long " * 100)[:39] + CLEARED


@pytest.fixture
def pauses(monkeypatch):
    monkeypatch.setattr(module, "FIRST_PAUSE", 0.1)
    monkeypatch.setattr(module, "LINE_INTERVAL", 0.1)


def test_in_a_pipe_a_line_every_few_seconds_says_what_is_being_done(capsys, pauses):
    with module.Progress() as progress:
        time.sleep(0.15)
        progress.say("start 1 of 8")
        time.sleep(0.2)
    time.sleep(0.2)
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == ""
    assert lines[0] == "loomopt: at work (0 s)"
    assert len(lines) >= 2, "nothing after the end"
    assert set(lines[1:]) == {"loomopt: start 1 of 8 (0 s)"}


def test_what_takes_a_few_seconds_says_nothing_in_a_pipe(capsys):
    assert 3.0 <= INTERVAL <= 10.0
    with module.Progress() as progress:
        for step in range(3):
            progress.say(f"start {step} of 3")
    assert capsys.readouterr() == ("", "")
    assert not progress.timer.is_alive() or progress.timer.finished.is_set()


def test_a_reader_that_has_left_does_not_stop_the_work(monkeypatch, pauses):
    reading, writing = os.pipe()
    os.close(reading)
    monkeypatch.setattr(sys, "stderr", os.fdopen(writing, "w", closefd=False))
    with module.Progress() as progress:
        progress.say("start 1 of 8")
        time.sleep(0.25)
        assert progress.timer.is_alive(), "it is tried again"
    monkeypatch.undo()
    os.close(writing)


LONG_COMMAND = """
import time
from loomopt.interface import progress
from loomopt.interface.cli import app
from loomopt.studies import sweep

def slow(self, task, parent, genuine=sweep.Sweep.solved):
    time.sleep(0.4)
    return genuine(self, task, parent)

progress.LINE_INTERVAL, sweep.Sweep.solved = 0.3, slow
raise SystemExit(app.run(["sweep", "beatup", "--over", "operation.M0=700:720:10 N*m", "--json"]))
"""


@pytest.mark.slow
def test_a_long_command_in_a_pipe_is_heard_on_stderr_alone():
    done = subprocess.run([sys.executable, "-c", LONG_COMMAND], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0
    assert done.stdout.startswith("{")
    lines = done.stderr.splitlines()
    assert len(lines) >= 2
    assert all(line.startswith("loomopt: ") and line.endswith(" s)") for line in lines)
    assert " of 3 points (" in lines[-1]


def cells(monkeypatch, *sources):
    """Return what cells of a notebook leave when they are run one after the other."""
    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(textwrap.dedent(source)) for source in sources]
    )
    client = NotebookClient(notebook, timeout=120, kernel_name="python3", allow_errors=True)
    received = []
    genuine = client.process_message

    def heard(message, *arguments):
        received.append(message)
        return genuine(message, *arguments)

    monkeypatch.setattr(client, "process_message", heard)
    client.execute()
    return notebook.cells, received


@pytest.mark.slow
def test_in_jupyter_progress_stands_below_the_cell_and_a_wrong_unit_is_one_sentence(monkeypatch):
    (_, wrong), messages = cells(
        monkeypatch,
        """
        import loomopt as lo
        from loomopt.interface import progress
        progress.FIRST_PAUSE = 0.0
        lo.solve("rapier")
        study = lo.sweep("beatup", {"operation.M0": "700:720:10 N*m"})
        """,
        'lo.load("beatup").set("operation.M0", "745 kg")',
    )
    shown = [
        message["content"]["data"]["text/plain"]
        for message in messages
        if message["msg_type"] in ("display_data", "update_display_data")
    ]
    assert any(text.startswith("start") or "building" in text for text in shown)
    assert [text for text in shown if text.endswith("of 3 points")][-1] == "3 of 3 points"
    assert shown[-1] == "", "it is taken back"
    (error,) = wrong.outputs
    assert error.ename == "BadInput"
    (sentence,) = error.traceback
    assert "\n" not in sentence
    assert sentence.startswith("BadInput: ")
    assert "operation.M0" in sentence
    assert "745 kg" in sentence


def test_a_script_is_told_nothing():
    with module.cell_progress() as say:
        assert say is None
