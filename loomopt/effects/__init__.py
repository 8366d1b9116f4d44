"""The effects a scene may call for: one file each, in a folder per job; kinds.py says what each may declare.

Called, as `loomopt.effects(scene)`, it is the public function of that name: what each effect is worth.
"""

import sys
from types import ModuleType

import loomopt


class _Room(ModuleType):
    """This package, which stands where the public function of its name is looked for once it is imported."""

    def __call__(self, *given: object, **options: object) -> object:
        study = loomopt.__getattr__("effects")
        assert callable(study)
        return study(*given, **options)


sys.modules[__name__].__class__ = _Room
