"""An element whose switching functions have constant signs, as within a step of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from floatframe.model.elements.element import ElementLaw, Placed
from floatframe.model.elements.element_proxy import ElementProxy

__all__ = ["HeldSigns"]


@dataclass(frozen=True, eq=False)
class HeldSigns(ElementProxy):
    """Replaces an element; its law uses given signs."""

    signs: Sequence[int]  #: of its switching functions, 1 or -1

    def law(self, placed: Placed) -> ElementLaw:
        """Return its law with these signs."""
        law = self.element.law(placed)
        return replace(law, data=[*law.data, *map(float, self.signs)], switches=())
