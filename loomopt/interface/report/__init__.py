"""Self-contained page of answers and studies: markup, SVG, and a script that only looks up positions."""

from importlib.resources import files
from importlib.resources.abc import Traversable


def report_path(name: str) -> Traversable:
    """A packaged file of the page, such as its script."""
    return files(__name__).joinpath(name)
