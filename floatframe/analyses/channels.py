"""Channels: named scalar motions of markers, as inputs (a force along it) and outputs (the motion along it)."""

from dataclasses import dataclass, field

import numpy as np

from cms.arrays import Array
from floatframe.arrays import unit_vector
from floatframe.compiled import CompiledSystem
from floatframe.errors import ModelError
from floatframe.kernels.model import Work
from floatframe.marker_data import MarkerData, find_marker
from floatframe.markers import Marker
from floatframe.rotations import right_jacobian, tilde
from floatframe.system import System

__all__ = ["Channel", "channel_rows"]

QUANTITIES = ("translation", "rotation")


@dataclass(frozen=True, eq=False)
class Channel:
    """The motion of a marker along a direction: displacement [m], or rotation [rad] about it.

    As an input it is the force [N], or moment [N m], that does work on it. With `relative_to`, the motion against
    that marker, and the opposite force on it.
    """

    name: str
    marker: Marker
    direction: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))  #: ground axes, (3,)
    quantity: str = "translation"  #: or "rotation"
    relative_to: Marker | None = None

    def __post_init__(self) -> None:
        where = f"channel {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        if self.quantity not in QUANTITIES:
            raise ModelError(f"{where}: quantity: expected one of {', '.join(QUANTITIES)}, got {self.quantity!r}")


def channel_rows(system: System, compiled: CompiledSystem, work: Work, channels: tuple[Channel, ...]) -> Array:
    """Return the derivative of the channels by the unknowns of small motions (body axes), (n_channels, n_u)."""
    rows = np.zeros((len(channels), int(compiled.model.u0[-1])))
    for row, channel in zip(rows, channels, strict=True):
        for sign, marker in ((1.0, channel.marker), (-1.0, channel.relative_to)):
            if marker is None:
                continue
            data = find_marker(system, f"channel {channel.name!r}: marker", marker)
            if data.body >= 0:
                u = slice(int(compiled.model.u0[data.body]), int(compiled.model.u0[data.body + 1]))
                first = 0 if channel.quantity == "translation" else 3
                row[u] += sign * channel.direction @ marker_jacobian(compiled, work, data)[first : first + 3]
    return rows


def marker_jacobian(compiled: CompiledSystem, work: Work, data: MarkerData) -> Array:
    """Return translation and rotation (ground axes) of a marker by the motion of its body (body axes), (6, 6 + n)."""
    model, i = compiled.model, data.body
    n = int(model.n_q[i])
    q = work.q[int(model.q0[i]) : int(model.q0[i + 1])]
    R = work.R[i]
    if data.psi is None:
        rho, psi, angle = data.position, None, np.zeros(3)
    else:
        psi = data.psi if data.bend is None else data.psi - data.bend @ q
        d = 0.5 * (data.psi + psi) @ q
        rho, angle = data.position + d[:3], d[3:]
    J = np.zeros((6, 6 + n))
    J[:3, :3] = J[3:, 3:6] = np.eye(3)
    J[:3, 3:6] = -tilde(rho)
    if psi is not None:
        J[:3, 6:] = psi[:3]
        J[3:, 6:] = right_jacobian(angle).T @ psi[3:]  # rotation of E in body axes before E
    return np.kron(np.eye(2), R) @ J
