"""Ctrl-C and SIGTERM from the first moment on: status 130 and one line, whatever is being imported; closed streams."""

import os
import signal
import subprocess
import sys
import time

import pytest
from support import slow

HIT = """
import os, signal, sys

class Hit:
    def find_spec(self, name, path=None, target=None):
        if name == hit:
            os.kill(os.getpid(), signal.SIGINT)
            len(name)  # signals are seen between two steps of the interpreter

hit = sys.argv.pop(1)
sys.meta_path.insert(0, Hit())
from loomopt.__main__ import main
main()
"""
"""The command as the shell starts it; Ctrl-C arrives while one module is looked for."""
SWALLOWED = """
import os, signal
from loomopt.base import interrupts

class Closed:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        len("")

def run():
    {what}
    return 0

raise SystemExit(interrupts.stoppable(run))
"""
ENDED = """
import os, signal, sys
from loomopt.interface.cli import app as cli; from loomopt.interface import progress

def say(self, text):
    if text.startswith("2 of"):
        os.kill(os.getpid(), signal.SIGTERM)
        len(text)

if __name__ == "__main__":
    progress.Progress.say = say
    cli.main()
"""
"""A study that is asked to end once two rows are there."""
COMMAND = [sys.executable, "-m", "loomopt"]


def called(*command, **streams):
    return subprocess.run(
        command, capture_output=not {"stdout", "stderr"} & set(streams), text=True, timeout=120, **streams
    )


def is_stopped(done):
    return (done.returncode, done.stdout, done.stderr) == (
        130, "", "loomopt: stopped; nothing was left half-written.\n")  # fmt: skip


@pytest.mark.few(3)
@pytest.mark.parametrize(
    "module",
    slow.after(6, [
     "loomopt.interface.cli.app", "pydantic", "loomopt.scenes.scene", "casadi", "numpy", "loomopt.solving.engine",
     "typer", "loomopt.base.errors", "loomopt.jobs.beatup.job", "numpy.linalg",
     "loomopt.solving.certificate.certificate", "rich.table"]),
)  # fmt: skip
def test_ctrl_c_during_an_import_stops_cleanly(module):
    assert is_stopped(called(sys.executable, "-c", HIT, module, "solve", "beatup"))


@pytest.mark.parametrize(
    "subject",
    ["os.kill(os.getpid(), signal.SIGINT)", "Closed()",
     "try:\n        os.kill(os.getpid(), signal.SIGINT)\n    except KeyboardInterrupt:\n        raise ImportError"],
    ids=["raised", "swallowed", "turned into another error"],
)  # fmt: skip
def test_ctrl_c_stops_whatever_a_library_makes_of_it(subject):
    assert is_stopped(called(sys.executable, "-c", SWALLOWED.format(what=subject)))


@pytest.mark.slow
def test_sigterm_stops_as_ctrl_c_does_and_workers_leave_nothing_behind(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(ENDED)
    over = ("--over", "operation.M0=600:900:50 N*m", "--workers", "2", "--out", "t.csv")
    done = called(sys.executable, str(script), "sweep", "beatup", *over, cwd=tmp_path)
    assert done.returncode == 130
    assert done.stdout.startswith("beatup, balance: 2 of 7 points")
    *_, wrote, stopped = done.stderr.splitlines()  # after lines of progress, on a slow machine
    assert wrote == "Wrote t.csv, 2 of the 7 points, as far as they were finished"
    assert stopped == "loomopt: stopped; nothing was left half-written."
    assert (tmp_path / "t.csv").exists()


STARTING = """
import multiprocessing.process, os, signal, sys, threading, time
from loomopt.interface.cli import app as cli

begin, begun = multiprocessing.process.BaseProcess.start, []

def hit():
    time.sleep(float(wait))
    (os.killpg if group == "group" else os.kill)(os.getpid(), int(number))

def start(self):
    begun.append(self)
    if len(begun) == int(count):
        threading.Thread(target=hit, daemon=True).start()
    begin(self)

if __name__ == "__main__":
    count, wait, number, group = sys.argv[1:5]
    del sys.argv[1:5]
    multiprocessing.process.BaseProcess.start = start
    cli.main()
"""
"""A study that is asked to end some time after its first or second worker begins to start, alone or with its group."""
WORKING = {
    "sweep": ["sweep", "beatup", "--over", "operation.M0=600:900:50 N*m"],
    "pareto": ["pareto", "beatup", "--minimise", "peak_torque", "--against", "m4e", "--points", "5"],
    "tolerance": ["tolerance", "beatup", "--set", 'tolerances.l1={ plus_minus = "0.05 mm" }'],
    "sensitivity": ["sensitivity", "beatup"],
}
SLOW_CHILD = "import sys, time\nif '--multiprocessing-fork' in sys.orig_argv:\n    time.sleep(1)\n"
"""What every interpreter runs first: a worker takes its time to start."""
MOMENTS = [
    (study, count, wait, number, group)
    for study in WORKING
    for count in ("1", "2")
    for wait in ("0", "0.3", "0.9", "1.1", "2")
    for number in (signal.SIGTERM, signal.SIGINT)
    for group in ("alone", "group")
]


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="there are no groups of processes here")
@pytest.mark.few(1, slow=11)
@pytest.mark.parametrize(("study", "count", "wait", "number", "group"), MOMENTS)
def test_what_stops_a_study_whose_workers_start_leaves_no_traceback(tmp_path, study, count, wait, number, group):
    script = tmp_path / "study.py"
    script.write_text(STARTING)
    (tmp_path / "sitecustomize.py").write_text(SLOW_CHILD)
    results = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    words = [sys.executable, str(script), count, wait, str(int(number)), group, *WORKING[study], "--workers", "2"]
    done = called(*words, cwd=tmp_path, start_new_session=True, env=results)
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 130)  # it may have been quicker
    if done.returncode == 130:
        assert done.stderr.splitlines()[-1] == "loomopt: stopped; nothing was left half-written."


def test_sigterm_during_an_import_stops_cleanly():
    assert is_stopped(called(sys.executable, "-c", HIT.replace("SIGINT", "SIGTERM"), "numpy", "solve", "beatup"))


def test_an_error_without_ctrl_c_is_an_error():
    done = called(sys.executable, "-c", SWALLOWED.format(what="raise ImportError"))
    assert done.returncode == 1
    assert "ImportError" in done.stderr


def test_ctrl_c_stays_ignored_where_it_was():
    """As in a shell's background job."""
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + HIT
    done = called(sys.executable, "-c", code, "typer", "list")
    assert (done.returncode, done.stderr) == (0, "")
    assert "beatup" in done.stdout


@pytest.mark.slow
def test_ctrl_c_at_any_moment_of_a_start_leaves_no_traceback():
    """By the clock, from where the interpreter itself has started."""
    for wait in (0.05, 0.1, 0.2, 0.3, 0.45):
        with subprocess.Popen(
            [sys.executable, "-c", "from loomopt.__main__ import main\nprint(flush=True)\nmain()", "solve", "rapier"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as process:  # fmt: skip
            process.stdout.readline()
            time.sleep(wait)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        assert "Traceback" not in err
        assert process.returncode == 130 or (process.returncode == 0 and "rapier" in out)  # it may have been quicker


@pytest.mark.parametrize("words", ["list", "solve beatup --json", "evaluate beatup", "--version", "solve betup"])
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_stream_closed_from_the_start_is_bad_input(closed, words):
    done = called("sh", "-c", f'"$0" -m loomopt {words} {closed}', sys.executable)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == (closed == ">&-")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("words", ["list", "solve beatup --json", "evaluate beatup", "simulate beatup", "--help"])
@pytest.mark.few(1)
def test_a_reader_that_leaves_is_no_error(words):
    reading, writing = os.pipe()
    os.close(reading)
    done = called(*COMMAND, *words.split(), stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_listener_that_leaves_does_not_change_the_exit_status():
    for words, status in (("solve betup", 2), ("list", 0)):
        reading, writing = os.pipe()
        os.close(reading)
        done = called(*COMMAND, *words.split(), stdout=subprocess.PIPE, stderr=writing)
        os.close(writing)
        assert done.returncode == status


@pytest.mark.few(1)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no such device here")
@pytest.mark.parametrize("words", ["list", "solve beatup --json", "evaluate beatup"])
def test_output_on_a_full_disk_is_bad_input(words):
    with open("/dev/full", "w") as full:
        done = called(*COMMAND, *words.split(), stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "No space left on device" in done.stderr
