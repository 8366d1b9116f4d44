"""Problems solved in one thread after another, then so many times in four threads at once: the same, to the digit.

    python four_threads.py [TIMES [PROBLEM ...]]    all problems unless some are named

Run by test_threads.py: where expressions of two threads meet, the process ends without a word.
"""

import gc
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import loomopt as lo
from loomopt.model import session
from loomopt.solving.nlp import transcribe

PROBLEMS = {
    "beatup-light": ("balance", ()),
    "rapier": (None, ()),
    "shedding-static": (None, ()),
    "beatup": ("balance", ("gravity", "rod_inertia")),
}
"""Scene → target and effects that are put on."""
USES = ("solve", "evaluate", "simulate", "prove")
THREADS = 4


def used(name, how):
    """Return the digits of one use of a problem, and what it counted."""
    target, effects = PROBLEMS[name]
    scene = lo.load(name)
    for effect in effects:
        scene = scene.with_effect(effect)
    if how == "solve":
        answer = lo.solve(scene, target, starts=1)
        return answer.design, answer.figures, answer.certificate, answer.solver, answer.message
    if how == "evaluate":
        return lo.evaluate(scene, target=target).as_dict()
    if how == "simulate":
        return lo.simulate(scene).to_csv()
    return lo.prove(scene, target=target).as_dict()


def together(times, names, alone):
    """Uses of a problem that differ from those alone, of four threads that begin with one problem after another."""
    differing, begin = set[tuple[str, str]](), threading.Barrier(THREADS)

    def work(first):
        begin.wait()
        for k in range(times):
            if first == 0 and k % 3 == 0:
                session.current().forget(transcribe.NLPS)
            for place in range(len(names)):
                name = names[(first + place) % len(names)]
                for how in USES if k == 0 else ("solve", "evaluate"):
                    if repr(used(name, how)) != alone[name, how]:
                        differing.add((name, how))
            print(f"thread {first}: {k + 1} of {times}", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(work, range(THREADS)))
    return differing


def collecting(stop):
    """Collect garbage again and again, so that what CasADi made is let go of in a thread that computes nothing."""
    while not stop.wait(0.1):
        gc.collect()


if __name__ == "__main__":
    names = sys.argv[2:] or list(PROBLEMS)
    alone = {(name, how): repr(used(name, how)) for name in names for how in USES}
    gc.freeze()
    stop = threading.Event()
    collector = threading.Thread(target=collecting, args=(stop,))
    collector.start()
    try:
        differing = together(int(sys.argv[1]) if sys.argv[1:] else 1, names, alone)
    finally:
        stop.set()
    print("differing:", sorted(differing) or "none")
    sys.exit(bool(differing))
