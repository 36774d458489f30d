"""Gaps between bodies that meet, as the kernels see them."""

from collections.abc import Sequence

from floatframe.engine.compiling.connections import Connections
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.kernels.model import CONTACT, Contacts, Gaps
from floatframe.engine.kernels.records import of_items

__all__ = ["gap_record"]


def gap_record(made: Connections, contacts: Contacts, laws: Sequence[PlacedLaw]) -> Gaps:
    """Return the gaps of all contacts, then those that elements name."""
    gaps = []
    for c in (c for c, law in enumerate(made.law) if law == CONTACT):
        i = made.item[c]
        numbers = {"stiffness": contacts.stiffness[i], "exponent": contacts.exponent[i]}
        gaps.append({"connection": c, "output": -1} | numbers)
    for placed in laws:
        for name, spring in placed.law.gaps.items():
            numbers = {"stiffness": spring.stiffness, "exponent": spring.exponent}
            gaps.append({"connection": placed.connection, "output": placed.law.outputs.index(name)} | numbers)
    return of_items(Gaps(), gaps)
