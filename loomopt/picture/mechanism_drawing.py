"""Mechanisms of links drawn at full scale: a job gives joints and labels; the rest is the same for all jobs."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from loomopt.base.records import lazy
from loomopt.picture.drawing import Label, Skeleton
from loomopt.picture.force_arrows import NOWHERE, ForceArrow, Sheet
from loomopt.picture.motion import MechanismMotion
from loomopt.picture.shapes import METRIC, Drawing, Floats, Measure, Point, Primitive, Units


class MechanismDrawing(ABC):
    """Mechanism of a design at its events and over the turn; lengths in m, angles in rad."""

    @property
    @abstractmethod
    def base(self) -> Skeleton:
        """Skeleton without its moving joints."""

    @property
    @abstractmethod
    def events(self) -> Mapping[str, float]:
        """Crank angles at which it is drawn, by layer."""

    @property
    @abstractmethod
    def height(self) -> float:
        """Text height."""

    @abstractmethod
    def places(self, angles: Floats) -> Mapping[str, Floats]:
        """Moving joints at crank angles, (n, 2) by name."""

    @abstractmethod
    def labels(self, units: Units) -> Sequence[Label]:
        """Names of joints and links; joints first, because they must be closest."""

    @abstractmethod
    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Lines below the drawing, each with its layer."""

    def strokes(self) -> Sequence[Primitive]:
        """Strokes besides joints and links."""
        return ()

    def measures(self) -> tuple[Measure, ...]:
        """Lengths that are written in the drawing."""
        return ()

    @property
    def force_event(self) -> str:
        """Event just before which forces are drawn; "" for none."""
        return next(iter(self.events))

    def force_joints(self) -> Mapping[str, str]:
        """Joints of the forces that are not called after them."""
        return NOWHERE

    @lazy
    def skeleton(self) -> Skeleton:
        """Joints at each event, and links."""
        at = self.places(np.array(list(self.events.values())))
        joints = {
            event: {name: Point(*map(float, place[k])) for name, place in at.items()}
            for k, event in enumerate(self.events)
        }
        return replace(self.base, joints=joints)

    def motion(self, angles: Floats) -> MechanismMotion:
        """Mechanism at crank angles, (n,)."""
        return MechanismMotion(angles, self.base.pivots, self.places(angles), self.base.links, self.base.guides)

    def drawing(self, title: str, units: Units = METRIC, forces: Mapping[ForceArrow, str] | None = None) -> Drawing:
        """Drawing at full scale; forces: in its joints at some crank angles, each labelled with its size."""
        strokes = [*self.skeleton.strokes(self.height), *self.strokes()]
        labels, legend, measures = self.labels(units), self.legend(units), self.measures()
        sheet = Sheet(title, self.height, strokes, labels, legend, units, self.force_event, measures)
        return sheet.drawing(forces, self.motion)


def pairs(place: tuple[object, object], count: int) -> Floats:
    """Places of a joint, (count, 2), from both coordinates, which may be numbers."""
    x, y = (np.broadcast_to(np.asarray(coordinate, dtype=np.float64), (count,)) for coordinate in place)
    return np.column_stack((x, y))
