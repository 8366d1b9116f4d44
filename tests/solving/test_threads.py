"""Threads that solve, evaluate, simulate and prove at once: the same digits and counts as one after another."""

import signal
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.model import session
from loomopt.model.sampling import SAMPLERS
from loomopt.model.session import Session, current, working
from loomopt.solving.nlp.transcribe import NLPS

HERE = Path(__file__).parent


@pytest.mark.parametrize(
    ("times", "problems"),
    [(1, ("beatup-light", "shedding-static")), pytest.param(100, (), marks=pytest.mark.slow)],
)
def test_four_threads_find_the_digits_of_one(times, problems):
    command = [sys.executable, str(HERE / "four_threads.py"), str(times), *problems]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    assert done.stdout == "differing: none\n"


INTERRUPTED = """
import os, signal, sys, threading
import loomopt as lo

scene, begun = lo.load("beatup"), threading.Event()

def other():
    begun.wait()
    print(lo.solve(scene, starts=1).status, flush=True)

def hook(number):
    begun.set()
    if number == 3:
        os.kill(os.getpid(), signal.SIGINT)

thread = threading.Thread(target=other)
thread.start()
try:
    {main}
except KeyboardInterrupt:
    print("stopped", flush=True)
thread.join()
"""
SOLVES = 'lo.solve(scene, "torque", starts=50, on_iteration=hook)'
WAITS = """begun.set()
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    while True:
        lo.solve(scene, starts=1)"""


def run(main):
    code = textwrap.dedent(INTERRUPTED).format(main=main)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)


@pytest.mark.slow
def test_ctrl_c_stops_the_solve_and_lets_the_thread_that_waits_go_on():
    done = run(SOLVES)
    assert (done.returncode, done.stdout.split()) == (0, ["stopped", "optimal"]), done.stderr


@pytest.mark.slow
def test_ctrl_c_stops_a_main_thread_that_waits_for_another():
    done = run(WAITS)
    assert done.returncode == 0, done.stderr
    assert sorted(done.stdout.split()) == ["optimal", "stopped"]


def test_a_session_of_ones_own_keeps_and_counts_apart():
    scene, values = lo.load("beatup-light"), Session()
    lo.solve(scene, starts=1)
    there, counted = current().count(NLPS), current().positions
    with working(values):
        assert current() is values
        answer = lo.solve(scene, starts=1)
    assert (current().count(NLPS), current().positions) == (there, counted)
    assert values.count(NLPS) >= 1
    assert values.positions >= answer.solver["evaluations"] > 0
    with working(values):
        again = lo.solve(scene, starts=1)
    assert again.time["build_s"] < answer.time["build_s"], "what it built is found again"
    assert again.design == answer.design
    assert again.solver["evaluations"] <= answer.solver["evaluations"], "today's machine is kept with its scene"
    assert {**again.solver, "evaluations": 0} == {**answer.solver, "evaluations": 0}


def test_what_is_kept_goes_by_use_and_when_it_is_let_go():
    values, made = Session(), list[int]()

    def made_of(key):
        made.append(key)
        return key

    def cached(key):
        return values.cached(SAMPLERS, 2, key, lambda: made_of(key))

    assert [cached(key) for key in (1, 2, 1, 3, 1, 2)] == [1, 2, 1, 3, 1, 2]
    assert made == [1, 2, 3, 2], "the least recently used has gone"
    values.forget(SAMPLERS)
    assert values.count(SAMPLERS) == 0


def test_another_thread_computes_in_the_session_of_the_process():
    results = []
    thread = threading.Thread(target=lambda: results.append(current()))
    with working(Session()):
        thread.start()
        thread.join()
    assert results == [session.OF_PROCESS]


def test_a_session_that_ends_in_an_error_leaves_room_for_the_next():
    with pytest.raises(KeyboardInterrupt), working():
        signal.raise_signal(signal.SIGINT)
    thread = threading.Thread(target=lambda: lo.evaluate("beatup-light"))
    thread.start()
    thread.join(timeout=60)
    assert not thread.is_alive()
