"""A job's effects: every file of its folder that declares one."""

import functools
import importlib
import pkgutil
from collections.abc import Mapping

from loomopt.effects.kinds import Effect, ranked


@functools.cache
def of(package: str) -> Mapping[str, Effect]:
    """Return the effects that the modules of a package declare as EFFECT, by name, the lowest rank first."""
    folder = importlib.import_module(package)
    names = [found.name for found in pkgutil.iter_modules(folder.__path__)]
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    return ranked(module.EFFECT for module in modules if hasattr(module, "EFFECT"))
