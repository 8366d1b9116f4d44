"""What the commands share: progress that comes of itself, errors in the words of the command line."""

import os
import pty
import sys
import time

import pytest

from loomopt.base.errors import BadInput
from loomopt.interface.cli import shell

CLEARED = "\x1b[K"


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
    monkeypatch.setattr(shell, "SILENT", 0.05)
    with shell.Progress() as progress:
        progress.say("building the law")
        assert terminal.shown() == "\rbuilding the law\x1b[K", "though nothing was said after the first second"
        progress.say("start 3 of 8")
        assert terminal.shown() == "\rstart 3 of 8\x1b[K"
    assert terminal.shown() == "\r\x1b[K"


def test_what_takes_no_longer_than_a_second_says_nothing_not_even_later(monkeypatch):
    terminal = Terminal(monkeypatch)
    monkeypatch.setattr(shell, "SILENT", 0.05)
    with shell.Progress() as progress:
        progress.say("proving")
    assert terminal.shown(patience=0.3) == ""


def test_a_line_longer_than_the_terminal_is_cut_so_that_it_can_be_taken_back(monkeypatch):
    terminal = Terminal(monkeypatch)
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(shell, "SILENT", 0.0)
    with shell.Progress() as progress:
        progress.say("long " * 100)
        text = terminal.shown()
    assert text == "\r" + ("long " * 100)[:39] + CLEARED


def test_nothing_is_said_in_a_pipe(capsys, monkeypatch):
    monkeypatch.setattr(shell, "SILENT", 0.0)
    with shell.Progress() as progress:
        progress.say("start 1 of 8")
        time.sleep(0.05)
    assert capsys.readouterr() == ("", "")
    assert progress.timer is None


@pytest.mark.parametrize("key", shell.OPTIONS)
def test_an_argument_is_an_option_at_the_command_line(key):
    error = BadInput("it is out of range", file="a.toml", key=key, value="3", allowed="1 to 2", remedy="Give 1.")
    assert str(error) == f"a.toml: {key}: it is out of range (given: 3). Allowed: 1 to 2. Give 1."
    assert str(shell.worded(error)) == str(error).replace(key, f"--{key}", 1)


def test_a_key_of_a_scene_is_no_option():
    error = BadInput("it is no table", file="a.toml", key="targets", remedy="Correct it.")
    assert shell.worded(error) is error
