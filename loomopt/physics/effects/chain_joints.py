"""Forces in the joints of a chain of parts, as effects of all jobs read them: by the names of their figures."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from loomopt.base.records import lazy
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.kinds import Inputs, Loading

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain, ChainPose
    from loomopt.physics.mechanisms.chain_forces import Walk
    from loomopt.physics.mechanisms.dyad import Vector


class ChainForces(ABC):
    """Forces at one instant, each when it is first read: `force_JOINT`, N, and `teeth_GEAR`, N."""

    def __init__(self, at: Inputs[Any], loading: Loading) -> None:
        self.at, self.loading = at, loading

    @property
    @abstractmethod
    def linked(self) -> "Chain":
        """Parts of the mechanism."""

    @property
    @abstractmethod
    def placed(self) -> "ChainPose":
        """Parts at the instant; of links their direction and the first derivative of their angle are read."""

    @abstractmethod
    def loaded(self) -> "Walk":
        """Chain with its loads, not yet solved."""

    @lazy
    def walk(self) -> "Walk":
        """Chain with the forces in all its joints."""
        return self.loaded().solve_all()

    def __getattr__(self, name: str) -> "Vector | Number":
        if name.startswith("teeth_"):
            return self.walk.teeth[name.removeprefix("teeth_")]
        if not name.startswith("force_"):
            raise AttributeError(f"{type(self).__name__} has no {name}, or it reads a number that is missing")
        return self.walk.forces[self._places[name]]

    @lazy
    def _places(self) -> Mapping[str, tuple[str, str]]:
        from loomopt.physics.mechanisms import chain_forces

        return {f"force_{name}": place for place, name in chain_forces.names(self.linked).items()}

    def heading(self, part: str) -> "Vector":
        """Unit direction of a body; of a slider that of its guide."""
        from loomopt.physics.mechanisms import chain_forces

        direction: Vector = self.placed.links[chain_forces.guides(self.linked).get(part, part)].unit()
        return direction

    @lazy
    def friction_work(self) -> Mapping[str, Number]:
        """Friction torque per newton in the pins, m per rad of the crank."""
        from loomopt.physics.mechanisms import chain_forces

        turned = {
            name: (f"force_{name}", chain_forces.pin_rotation(self.linked, self.placed, place))
            for place, name in chain_forces.pin_forces(self.linked).items()
        }
        return pins.works(self.at, turned)
