"""An element that stands for another one whose law an event or a switching function changes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fe_models.foundation.arrays import Array
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.element import Element, markers_of

__all__ = ["ElementProxy"]


@dataclass(frozen=True, eq=False)
class ElementProxy(Element):
    """Replaces an element, with the same name, markers and unknowns; subclasses change its law."""

    element: Element

    if not TYPE_CHECKING:

        @property
        def name(self) -> str:
            """Its name."""
            return self.element.name

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Its markers."""
        return markers_of(self.element)

    def events(self) -> Sequence[Any]:
        """Return its events."""
        return self.element.events()

    def small_angles(self) -> Callable[[Array], Array] | None:
        """Return the deviation of its angles from small angles."""
        return self.element.small_angles()

    def drawn(self) -> Any:
        """Return its shapes."""
        return self.element.drawn()
