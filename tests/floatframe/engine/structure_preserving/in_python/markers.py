"""Markers over a step: positions, rotations, and loads on them with exact work on their bodies.

Formulas: `floatframe.engine.structure_preserving.kernels.markers`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.model.bodies.marker_shape import MarkerShape
from floatframe.model.rotations import cross, dot, left_jacobian, rotated, rotation_exp
from tests.floatframe.engine.structure_preserving.in_python.bodies import Body, BodyStep
from tests.floatframe.engine.structure_preserving.in_python.rotation import relative_cayley

SMALL = 1e-14  #: square of an elastic rotation in a step below which its Cayley vector is T dth to rounding


@dataclass(frozen=True, eq=False)
class BodyMarker:
    """Constants of a marker; body -1 is the ground."""

    body: int
    constants: Body | None
    shape: MarkerShape  #: from the frame origin

    @property
    def turns(self) -> bool:
        """Whether it rotates in its body."""
        psi, bend = self.shape.psi, self.shape.bend
        return psi is not None and (bool(np.any(psi[3:])) or bend is not None)

    def shapes(self, q: Array) -> tuple[Array, Array]:
        """Return Psi_sigma(q) and Psi_r(q), (..., 3, n)."""
        assert self.constants is not None
        Psi = self.shape.shapes(q)
        return Psi[..., :3, :] - self.constants.shapes(q), Psi[..., 3:, :]

    def deformation(self, q: Array) -> tuple[Array, Array]:
        """Return sigma(q), from the centre of mass, and th(q), (..., 3)."""
        assert self.constants is not None
        d = self.shape.deformation(q)
        return self.shape.position + d[..., :3] - self.constants.center(q), d[..., 3:]


def body_marker(model: Model, bodies: tuple[Body, ...], m: int) -> BodyMarker:
    """Return the constants of marker m of a model."""
    i = int(model.markers.body[m])
    if i < 0:
        return BodyMarker(-1, None, MarkerShape(model.markers.position[m], model.markers.triad[m]))
    body, first, bend0 = bodies[i], int(model.markers.psi0[m]), int(model.markers.bend0[m])
    n = body.n
    psi = model.markers.psi[first : first + 6 * n].reshape(6, n) if first >= 0 else None
    bend = model.markers.bend[bend0 : bend0 + 6 * n * n].reshape(n, 6, n) if bend0 >= 0 else None  # [l, a, k]
    if bend is not None:
        bend = np.ascontiguousarray(np.moveaxis(bend, 0, 2))
    return BodyMarker(i, body, MarkerShape(model.markers.position[m], model.markers.triad[m], psi, bend))


class Load:
    """Generalised forces on one body, added up: force and torque about the centre of mass (ground axes), modal."""

    def __init__(self, n: int, shape: tuple[int, ...], kind: type) -> None:
        self.force: Array = np.zeros((*shape, 3), kind)
        self.torque: Array = np.zeros((*shape, 3), kind)
        self.modal: Array = np.zeros((*shape, n), kind)

    def work(self, step: BodyStep) -> Array:
        """Return the work over a step."""
        return dot(self.force, step.d) + dot(self.torque, step.theta_G) + dot(self.modal, step.dq)


@dataclass(frozen=True, eq=False)
class MarkerStep:
    """A marker over a step of its body; step None: on the ground."""

    marker: BodyMarker
    step: BodyStep | None
    x_0: Array
    x_1: Array
    lever: Array
    dx: Array
    rotation_0: Array  #: exp(th) in the body, (..., 3, 3)
    rotation_1: Array
    Gamma: Array | None  #: (..., 3, 3)
    dpsi: Array | None  #: Cayley vector of the elastic rotation, body axes, (..., 3)
    Psi_sigma: Array  #: derivative of sigma by q at the mean, (..., 3, n)
    Psi_r: Array  #: derivative of th, (..., 3, n)

    @property
    def x_mean(self) -> Array:
        """Mean position."""
        return 0.5 * (self.x_0 + self.x_1)

    def ends(self, e: Array) -> tuple[Array, Array]:
        """Return the direction e of the marker, ground axes, at both ends."""
        e = self.marker.shape.triad @ e
        if self.step is None:
            return e, e
        return rotated(self.step.R_0, self.rotation_0 @ e), rotated(self.step.R_1, self.rotation_1 @ e)

    def change(self, e: Array, E_mean: Array) -> Array:
        """Return dE of direction e."""
        if self.step is None:
            return np.zeros(3)
        change = cross(self.step.theta_G, E_mean)
        if self.dpsi is not None:
            change = change + rotated(self.step.R_m, cross(self.dpsi, self.eps_mean(e)))
        return change

    def turning(self) -> Array:
        """Return the rotation of the marker over the step, ground axes."""
        if self.step is None:
            return np.zeros(3)
        if self.dpsi is None:
            return self.step.theta_G
        return self.step.theta_G + rotated(self.step.R_m, self.dpsi)

    def eps_mean(self, e: Array) -> Array:
        """Return the mean of direction e in the body."""
        return 0.5 * (self.rotation_0 + self.rotation_1) @ (self.marker.shape.triad @ e)

    def add_force(self, load: Load | None, F: Array) -> None:
        """Add a force at the marker, with work F·dx."""
        if self.step is None or load is None:
            return
        load.force += F
        load.torque += cross(self.lever, F)
        F_B = rotated(np.swapaxes(self.step.R_m, -1, -2), F)
        load.modal += rotated(np.swapaxes(self.Psi_sigma, -1, -2), F_B)

    def add_direction(self, load: Load | None, e: Array, G: Array) -> None:
        """Add a load on direction e, with work G·dE."""
        if self.step is None or load is None:
            return
        E_0, E_1 = self.ends(e)
        load.torque += cross(0.5 * (E_0 + E_1), G)
        if self.Gamma is not None:
            m = cross(self.eps_mean(e), rotated(np.swapaxes(self.step.R_m, -1, -2), G))
            self.add_elastic(load, m)

    def add_moment(self, load: Load | None, T: Array) -> None:
        """Add a moment, with work T·turning."""
        if self.step is None or load is None:
            return
        load.torque += T
        if self.Gamma is not None:
            self.add_elastic(load, rotated(np.swapaxes(self.step.R_m, -1, -2), T))

    def add_elastic(self, load: Load, m: Array) -> None:
        """Add a moment m on the elastic rotation, body axes."""
        assert self.Gamma is not None
        load.modal += rotated(np.swapaxes(self.Psi_r, -1, -2), rotated(np.swapaxes(self.Gamma, -1, -2), m))


def marker_step(marker: BodyMarker, step: BodyStep | None) -> MarkerStep:
    """Return a marker over a step of its body."""
    if step is None:
        zero, none, place = np.zeros(3), np.zeros((3, 0)), marker.shape.position
        return MarkerStep(marker, None, place, place, zero, zero, np.eye(3), np.eye(3), None, None, none, none)
    (sigma_0, th_0), (sigma_1, th_1) = marker.deformation(step.q_0), marker.deformation(step.q_1)
    Psi_sigma, Psi_r = marker.shapes(0.5 * (step.q_0 + step.q_1))
    arm_0, arm_1 = rotated(step.R_0, sigma_0), rotated(step.R_1, sigma_1)
    lever = 0.5 * (arm_0 + arm_1)
    dx = step.d + cross(step.theta_G, lever) + rotated(step.R_m, rotated(Psi_sigma, step.dq))
    rotation_0 = rotation_1 = np.eye(3)
    Gamma = dpsi = None
    if marker.turns:
        rotation_0, rotation_1 = rotation_exp(th_0), rotation_exp(th_1)
        Gamma = mean_jacobian(th_0, th_1)
        dpsi = rotated(Gamma, rotated(Psi_r, step.dq))
    return MarkerStep(
        marker, step, step.c_0 + arm_0, step.c_1 + arm_1, lever, dx, rotation_0, rotation_1, Gamma, dpsi, Psi_sigma,
        Psi_r,
    )  # fmt: skip


def mean_jacobian(th_0: Array, th_1: Array) -> Array:
    """Return Gamma, (..., 3, 3)."""
    T = left_jacobian(0.5 * (th_0 + th_1))
    dth = th_1 - th_0
    square = dot(dth, dth)
    is_small = np.abs(square) < SMALL
    if np.all(is_small):
        return T
    rest = relative_cayley(th_0, th_1) - rotated(T, dth)
    factor = np.where(is_small, 0.0, 1.0 / np.where(is_small, 1.0, square))
    return T + rest[..., :, None] * dth[..., None, :] * factor[..., None, None]
