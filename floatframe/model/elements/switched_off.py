"""An element that an event has switched off; its rows remain, but it has no effect.

Its wrenches and state rates are zero, unless its law has a function `off` for this case (a closed valve, a dragging
clutch). Its constraints are released, and its multipliers are zero.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from floatframe.model.elements.element import NOTHING, ElementLaw, Placed
from floatframe.model.elements.element_proxy import ElementProxy

__all__ = ["SwitchedOff", "law_switched_off", "off_at_start", "times_off"]


class SwitchedOff(ElementProxy):
    """Replaces an element; it has no effect."""

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the element while it is off."""
        return law_switched_off(self.element.law(placed))


def law_switched_off(law: ElementLaw) -> ElementLaw:
    """Return the law of an element while it is off, with the same rows."""
    if law.off is not None:
        tangent = "differences" if callable(law.tangent) else law.tangent
        return replace(law, function=law.off, tangent=tangent, rest=None)
    let_go = (NOTHING,) * len(law.multipliers)
    return replace(law, function=still, tangent=slopes_of_still, rest=None, stops={}, holds=let_go, held_units=())


def off_at_start(events: Sequence[Any]) -> frozenset[str]:
    """Return the forces, couplers and elements that are off at the start, because their first event is to switch on."""
    first: dict[str, bool] = {}
    for event in events:
        for name in event.switch_on:
            first.setdefault(name, True)
        for name in event.switch_off:
            first.setdefault(name, False)
    return frozenset(name for name, is_off in first.items() if is_off)


def times_off(events: Sequence[Any], happened: Sequence[Mapping[str, Any]], t: Array, name: str) -> NDArray[np.bool_]:
    """Return, for each time t, (n_t,), whether past events have switched an element off."""
    is_off = np.full(len(t), name in off_at_start(events))
    for event in happened:
        if name in (*event["switch_on"], *event["switch_off"]):
            is_off[t >= event["t"]] = name in event["switch_off"]
    return is_off


@njit
def still(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write zero outputs for an element without effect."""
    for k in range(lam.shape[0]):
        g[k] = lam[k]


@njit
def slopes_of_still(t, x, z, lam, data, slopes):
    """Write the derivatives of `still`."""
    n_lam = lam.shape[0]
    for k in range(n_lam):
        slopes[slopes.shape[0] - n_lam + k, slopes.shape[1] - n_lam + k] = 1.0
