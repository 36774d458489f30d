"""An element whose switching functions have constant signs, as within a step of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.element import Element, ElementLaw, Placed, markers_of

__all__ = ["HeldSigns"]


@dataclass(frozen=True, eq=False)
class HeldSigns(Element):
    """Replaces an element, with the same markers and unknowns; its law uses given signs."""

    element: Element
    signs: Sequence[int]  #: of its switching functions, 1 or -1

    if not TYPE_CHECKING:

        @property
        def name(self) -> str:
            """Its name."""
            return self.element.name

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Its markers."""
        return markers_of(self.element)

    def law(self, placed: Placed) -> ElementLaw:
        """Return its law with these signs."""
        law = self.element.law(placed)
        return replace(law, data=[*law.data, *map(float, self.signs)], switches=())

    def events(self) -> Any:
        """Return its events."""
        return self.element.events()

    def drawn(self) -> Any:
        """Return its shapes."""
        return self.element.drawn()
