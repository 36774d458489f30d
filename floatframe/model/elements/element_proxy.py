"""An element that replaces another one whose law is changed by an event or a switching function."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fe_models.foundation.arrays import Array
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.element import Element, markers_of

__all__ = ["ElementProxy"]


@dataclass(frozen=True, eq=False)
class ElementProxy(Element):
    """Replaces an element with the same name, markers and unknowns; subclasses change the law."""

    element: Element

    if not TYPE_CHECKING:

        @property
        def name(self) -> str:
            """Name of the replaced element."""
            return self.element.name

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers of the replaced element."""
        return markers_of(self.element)

    def events(self) -> Sequence[Any]:
        """Return the events of the replaced element."""
        return self.element.events()

    def small_angles(self) -> Callable[[Array], Array] | None:
        """Return the measure of small angles of the replaced element."""
        return self.element.small_angles()

    def drawn(self) -> Any:
        """Return the shapes of the replaced element."""
        return self.element.drawn()
