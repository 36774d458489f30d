"""The force between a pin and its bearing: zero within the play, then a dissipative spring with friction.

With the depth x = (distance from the middle) - play and its rate, and u the outward direction from the bearing middle:

    N = k xⁿ max(0, 1 + chi x_dot)  for x > 0, else 0
    F = -N u - mu N V_t/sqrt(|V_t|² + v_s²)  on the pin, at the point q = p + r u of its surface

and -F on the bearing at the same point. V_t is the tangential velocity, normal to u, of the pin relative to the bearing
at q. The stored energy is k x^(n+1)/(n+1); the dissipated power is (N - k xⁿ) x_dot + mu N |V_t|²/sqrt(|V_t|² + v_s²),
never below zero. All functions accept real and complex numbers, see `floatframe.model.elements.smooth`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba.extending import register_jitable

from floatframe.model.checked_values import number
from floatframe.model.elements.pairs import inner_product, vector_product

__all__ = ["NUMBERS", "add_contact", "contact_numbers", "depth_force", "require_numbers"]

NUMBERS = 6  #: number of contact parameters in `data`: k, n, chi, mu, v_s, r


@dataclass(frozen=True)
class Range:
    """The allowed range of a parameter of a contact."""

    above: float | None = None
    at_least: float | None = None


RANGES = {
    "stiffness": Range(above=0.0),
    "exponent": Range(at_least=1.0),
    "damping": Range(at_least=0.0),
    "friction": Range(at_least=0.0),
    "friction_speed": Range(above=0.0),
    "radius": Range(at_least=0.0),
}


def require_numbers(element: Any, more: dict[str, Range]) -> None:
    """Check the parameters of an element with play, and store floats; `ModelError` for invalid values."""
    where = f"element {element.name!r}"
    for key, allowed in (RANGES | more).items():
        value = getattr(element, key, None)
        if value is not None:
            checked = number(f"{where}: {key}", value, above=allowed.above, at_least=allowed.at_least)
            object.__setattr__(element, key, checked)


def contact_numbers(element: Any) -> list[float]:
    """Return the parameters of the contact of an element, in the order in which its law reads them."""
    return [getattr(element, key, 0.0) for key in RANGES]


@register_jitable
def depth_force(depth, rate, data, at):
    """Return the normal force N, its elastic part and the elastic energy for a depth >= 0.

    data: k, n, chi, from index `at` on.
    """
    k, n, chi = data[at], data[at + 1], data[at + 2]
    if depth.real < 0.0:
        none = 0.0 * depth
        return none, none, none
    power = depth if n == 1.0 or depth.real == 0.0 else np.exp(n * np.log(depth))
    spring = k * power
    factor = 1.0 + chi * rate
    if factor.real < 0.0:
        factor = 0.0 * factor
    return spring * factor, spring, spring * depth / (n + 1.0)


@register_jitable
def add_contact(wrench, x, p, out, way, play, data, at):
    """Add the contact between the pin of marker 1 and the bearing of marker 0, at a point of the pin.

    p: the point, in ground axes. out: vector from the middle of the bearing to the point (distance times outward
    direction). play: free distance. Return the normal force, the stored energy and the dissipated power.
    """
    mu, slow, radius = data[at + 3], data[at + 4], data[at + 5]
    none = 0.0 * way
    if way.real < play or way.real == 0.0:
        return none, none, none
    u = out[0] / way, out[1] / way, out[2] / way
    q = p[0] + radius * u[0], p[1] + radius * u[1], p[2] + radius * u[2]
    a = q[0] - x[0, 0], q[1] - x[0, 1], q[2] - x[0, 2]
    b = q[0] - x[1, 0], q[1] - x[1, 1], q[2] - x[1, 2]
    by_a = vector_product((x[0, 15], x[0, 16], x[0, 17]), a)
    by_b = vector_product((x[1, 15], x[1, 16], x[1, 17]), b)
    V = (
        x[1, 12] - x[0, 12] + by_b[0] - by_a[0],
        x[1, 13] - x[0, 13] + by_b[1] - by_a[1],
        x[1, 14] - x[0, 14] + by_b[2] - by_a[2],
    )
    rate = inner_product(V, u)
    N, spring, energy = depth_force(way - play, rate, data, at)
    slip = V[0] - rate * u[0], V[1] - rate * u[1], V[2] - rate * u[2]
    rubbing = mu * N / np.sqrt(inner_product(slip, slip) + slow * slow)
    F = -N * u[0] - rubbing * slip[0], -N * u[1] - rubbing * slip[1], -N * u[2] - rubbing * slip[2]
    on_a, on_b = vector_product(a, F), vector_product(b, F)
    for k in range(3):
        wrench[1, k] += F[k]
        wrench[0, k] -= F[k]
        wrench[1, 3 + k] += on_b[k]
        wrench[0, 3 + k] -= on_a[k]
    return N, energy, (N - spring) * rate + rubbing * inner_product(slip, slip)
