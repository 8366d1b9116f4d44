"""loomopt: optimal design of weaving-loom mechanisms, certified.

>>> import loomopt as lo
>>> answer = lo.solve(lo.load("beatup"), target="balance")
"""

from loomopt.api import Answer, evaluate, load, scene, simulate, solve
from loomopt.errors import BadInput
from loomopt.scene import Scene
from loomopt.solve.solution import Evaluation

__version__ = "0.1.0"

__all__ = ["Answer", "BadInput", "Evaluation", "Scene", "__version__", "evaluate", "load", "scene", "simulate", "solve"]
