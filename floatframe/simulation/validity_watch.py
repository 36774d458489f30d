"""Check that every flexible body stays in the range of its linear frame, for each result row.

The stiffness of a body under its loads is K + Σ lambda_j K_j, with the amplitudes lambda of the unit loads (theory.md
§7): acceleration of the frame origin minus gravity, angular acceleration, products of the angular velocity, wrenches on
the interfaces, all in body axes. The relative change of the stiffness is A = Σ lambda_j K^(-1/2) K_j K^(-1/2). The
loads are -min(eig A) times the buckling loads of the body, and a linear frame has a stiffness error of max |eig A|.

If the body has no such matrices, those of the interface loads are estimated from the rotations of the interfaces.

The eigenvalues are computed once per batch of rows, where Σ |lambda_j| |K_j| is largest, and only if that bound exceeds
the limit and the largest value so far.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import scipy.linalg as la

from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.body.linear_range import LEFT_OUT, LINEAR, STIFFENED, Limits
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from cms.reduction.basis.frames import TisserandFrame
from cms.reduction.frame_conversion import converted
from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.counted_angles import first_angles
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.interface_loads import Load, Wrench, amplitudes, in_body, loads_on_interfaces
from floatframe.engine.compiling.markers import MarkerData
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, modal_matrix, set_iterate
from floatframe.engine.kernels.memory import Rows
from floatframe.engine.kernels.model import JOINT, STIFFNESS
from floatframe.engine.kernels.work import new_work
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.forces import Bushing
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import euler_parameter_product, euler_parameters, rotation_matrix, rotations_between
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote

__all__ = ["ANGLES_LIMIT", "ValidityWatch", "angle_measures"]


MOST_CONVERTED = 80  #: largest number of modes of a body whose rotations relative to mean axes are computed
ADVICE = {
    "angles": "limit large rotations to one axis, or use a joint for large rotations and a bearing for a shaft",
    "tilt": "use a joint for large rotations",
}
N_INERTIAL = 12  #: number of inertial loads: 3 accelerations, 3 angular accelerations, 6 products of angular velocities


@dataclass(eq=False)
class Watched:
    """Constants of one flexible body for the check."""

    index: int
    body: FlexibleBody
    limits: Limits
    frequency: float  #: lowest angular frequency with one of its joints fixed, or free [rad/s]
    Psi_r: Array  #: rotation shapes of the interfaces, (3 n, n_q)
    #: geometric stiffness K^(-1/2) K_j K^(-1/2) of all unit loads, (n_loads, n_q²); no rows if K is singular
    scaled: Array
    norms: Array  #: largest |eigenvalue| of each geometric stiffness, (n_loads,)
    by_mean_axes: Array | None = None  #: rotation shapes of the interfaces relative to mean axes, computed on request
    wrenches: list[Wrench] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)


class ValidityWatch:
    """Checks a motion, whose result rows `observe` takes in order, and stores notes."""

    def __init__(self, system: System, notes: tuple[ValidityNote, ...] = ()) -> None:
        """Begin with the notes of the completed part of the motion."""
        self.system = system
        self.found = {note.key: note for note in notes}
        elastic = [
            (i, body) for i, body in enumerate(system.bodies) if isinstance(body, FlexibleBody) and is_elastic(body)
        ]
        frequencies = held_frequencies(compiled_system(system), [i for i, _ in elastic]) if elastic else []
        self.angles = list(angle_measures(system))
        self.bodies = [watched(i, body, omega) for (i, body), omega in zip(elastic, frequencies, strict=True)]
        for part in self.bodies:
            if len(part.norms):
                part.wrenches, part.loads = loads_on_interfaces(system, part.index)

    @property
    def notes(self) -> tuple[ValidityNote, ...]:
        """Notes so far, ordered by time."""
        return tuple(sorted(self.found.values(), key=lambda note: note.t_first))

    def observe(self, rows: Rows) -> tuple[ValidityNote, ...]:
        """Take result rows and return new notes."""
        if len(rows.t) == 0:
            return ()
        told = rows_of_file(compiled_system(self.system), rows)
        new = self.observe_angles(rows)
        for part in self.bodies:
            for kind, values in self.measures(part, rows, told):
                limit = getattr(part.limits, kind)
                if not (values > limit).any():
                    continue
                k = int(np.nanargmax(values)) if np.isfinite(values).any() else 0
                largest = float(values[k])
                if not largest > limit:
                    continue
                key, t = (part.body.name, kind), float(rows.t[k])
                known = self.found.get(key)
                if known is not None and largest <= known.largest:
                    continue
                remedied = in_mean_axes(part, self.coordinates(part, rows)) if kind == "rotation" else -1.0
                if known is None:
                    first = float(rows.t[int(np.argmax(values > limit))])
                    has_matrices = part.body.reduced.geometric is not None
                    self.found[key] = ValidityNote(
                        *key, limit, largest, first, t, part.body.is_stiffened, has_matrices, remedied
                    )  # fmt: skip
                    new.append(self.found[key])
                else:
                    most = max(known.in_mean_axes, remedied)
                    self.found[key] = replace(known, largest=largest, t_largest=t, in_mean_axes=most)
        return tuple(new)

    def observe_angles(self, rows: Rows) -> list[ValidityNote]:
        """Take result rows and return new notes about the angles of bushings and bearings."""
        new = []
        for where, kind, measure in self.angles:
            values = measure(rows)
            k = int(np.argmax(values))
            largest, t, key = float(values[k]), float(rows.t[k]), (where, kind)
            if not largest > ANGLES_LIMIT:
                continue
            if key not in self.found:
                first = float(rows.t[int(np.argmax(values > ANGLES_LIMIT))])
                self.found[key] = ValidityNote(where, kind, ANGLES_LIMIT, largest, first, t, advice=ADVICE[kind])
                new.append(self.found[key])
            else:
                self.found[key] = self.found[key].with_value(largest, t)
        return new

    def measures(self, part: Watched, rows: Rows, told: Rows) -> list[tuple[str, Array]]:
        """Return the checked quantities for engine rows, in the body frames of the files, (n_t,).

        Rotations are relative to the frame in which the engine moves the body, loads refer to the frame of the file.
        """
        model = compiled_system(self.system).model
        i, u0 = part.index, int(model.bodies.u0[part.index])
        q = self.coordinates(part, rows)
        omega = rows.u[:, u0 + 3 : u0 + 6]
        speed = np.linalg.norm(omega, axis=1) / part.frequency
        found = [("speed", speed)]
        if part.body.reduced.moments.missing:
            found.append(("inertia", speed))
        if len(part.Psi_r):
            angles = (q @ part.Psi_r.T).reshape(len(q), -1, 3)
            found.append(("rotation", np.linalg.norm(angles, axis=2).max(axis=1)))
        if len(part.norms):
            found.append(("load", self.load_measure(part, told, i, u0)))
        return found

    def coordinates(self, part: Watched, rows: Rows) -> Array:
        """Return the modal coordinates of a body for the rows, (n_t, n_q)."""
        q0 = int(compiled_system(self.system).model.bodies.q0[part.index])
        return rows.q[:, q0 : q0 + part.body.reduced.n_q]

    def load_measure(self, part: Watched, rows: Rows, i: int, u0: int) -> Array:
        """Return the relative stiffness change due to loads, (n_t,); -1 for rows without evaluation."""
        R, omega = rotation_matrix(rows.p[:, i]), rows.u[:, u0 + 3 : u0 + 6]
        lam = np.zeros((len(rows.t), len(part.norms)))
        acceleration = rows.u_dot[:, u0 : u0 + 3] - compiled_system(self.system).model.gravity
        lam[:, :3] = in_body(R, acceleration)
        lam[:, 3:6] = rows.u_dot[:, u0 + 3 : u0 + 6]
        for k, (a, b) in enumerate(SPIN_PAIRS):
            lam[:, 6 + k] = (1 if a == b else 2) * omega[:, a] * omega[:, b]
        for wrench in part.wrenches:
            o = N_INERTIAL + 6 * wrench.interface
            if wrench.force >= 0:
                lam[:, o : o + 3] += wrench.sign * in_body(R, rows.w[:, wrench.force : wrench.force + 3])
            if wrench.moment >= 0:
                lam[:, o + 3 : o + 6] += wrench.sign * in_body(R, rows.w[:, wrench.moment : wrench.moment + 3])
        for load in part.loads:
            o = N_INERTIAL + 6 * load.interface
            lam[:, o : o + 6] += amplitudes(load, rows.t, R)
        values = np.full(len(rows.t), -1.0)
        bound = np.abs(lam) @ part.norms
        if not np.isfinite(bound).all():
            bound = np.nan_to_num(np.abs(lam)) @ part.norms
        k = int(np.argmax(bound))
        seen = self.found.get((part.body.name, "load"))
        if bound[k] > max(part.limits.load, seen.largest if seen else 0.0) and np.isfinite(lam[k]).all():
            n = part.body.reduced.n_q
            change = la.eigvalsh((lam[k] @ part.scaled).reshape(n, n))
            values[k] = -change[0] if part.body.is_stiffened else np.abs(change).max()
        return values


def in_mean_axes(part: Watched, q: Array) -> float:
    """Return the largest interface rotation relative to mean axes for q, (n_t, n_q) [rad]; -1: unknown.

    It is unknown if the body already has mean axes, if it has many modes (the conversion takes long), or if it cannot
    be converted.
    """
    reduced = part.body.reduced
    if part.body.is_stiffened or reduced.frame.kind == "tisserand" or reduced.n_q > MOST_CONVERTED:
        return -1.0
    if part.by_mean_axes is None:
        x, y, z = ((float(a), float(b), float(c)) for a, b, c in reduced.frame.axes.T)
        try:
            mean, change = converted(reduced, TisserandFrame(axes=(x, y, z)))
        except CmsError:
            return -1.0
        turning = [np.asarray(interface.Psi[3:]) for interface in mean.interfaces if interface.has_rotation]
        part.by_mean_axes = np.concatenate(turning) @ np.linalg.inv(change.Z)
    angles = (q @ part.by_mean_axes.T).reshape(len(q), -1, 3)
    return float(np.linalg.norm(angles, axis=2).max())


def is_elastic(body: FlexibleBody) -> bool:
    """Whether a body has a mode with mass."""
    return bool(np.isfinite(body.reduced.frequencies).any() and (body.reduced.frequencies > 0).any())


def held_frequencies(compiled: CompiledSystem, bodies: list[int]) -> list[float]:
    """Return the lowest positive angular frequency of each body with one joint fixed, over all joints [rad/s].

    The directions that the joint constrains are fixed, so that a body clamped by one of its joints has the frequency of
    a cantilever, independent of the frame of its file. A body without joints has the frequency of the free body. The
    frequency is infinite if none is positive.
    """
    model, work = compiled.model, new_work(compiled.model)
    set_iterate(work, compiled.placed)
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    rows = parts.G.tocsr()
    found = []
    for i in bodies:
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        K = np.zeros_like(parts.H[i])
        K[6:, 6:] = modal_matrix(model, i, STIFFNESS)
        lowest = []
        for c in np.flatnonzero(model.connections.law == JOINT):
            own = np.arange(model.connections.w0[c], model.connections.w0[c + 1])
            G = rows[own[is_held(model.rows.kind)[own]]][:, u].toarray()
            if G.any():
                lowest.append(lowest_frequency(parts.H[i], K, G))
        found.append(min(lowest) if lowest else lowest_frequency(parts.H[i], K, np.zeros((0, len(K)))))
    return found


def lowest_frequency(M: Array, K: Array, G: Array) -> float:
    """Return the lowest positive angular frequency of motions with G x = 0; rigid motions come first in x.

    K + s M is regular, so that the eigenvalues of (M, K + s M) are 1/(omega² + s); the largest belong to the rigid-body
    motions that G leaves free. Motions are scaled to a mass of 1, and modes without mass to the stiffness of the
    stiffest mode.
    """
    mass, stiffness = np.diag(M), np.diag(K)
    highest = np.max(stiffness[mass > 0] / mass[mass > 0]) or stiffness.max() or 1.0
    scale = 1 / np.sqrt(np.where(mass > 0, mass, np.where(stiffness > 0, stiffness, highest) / highest))
    G = G * scale
    G = G / np.linalg.norm(G, axis=1, keepdims=True)
    Z = la.null_space(G) if len(G) else np.eye(len(K))
    n_rigid = 6 - (np.linalg.matrix_rank(G[:, :6]) if len(G) else 0)
    M, K = Z.T @ (scale[:, None] * M * scale) @ Z, Z.T @ (scale[:, None] * K * scale) @ Z
    s = np.trace(K) / np.trace(M) / len(K)
    values = la.eigvalsh((M + M.T) / 2, (K + K.T) / 2 + s * (M + M.T) / 2)[::-1]
    elastic = values[n_rigid:]
    if not len(elastic) or not elastic[0] > 0:
        return float("inf")
    return float(np.sqrt(max(1 / elastic[0] - s, 0.0))) or float("inf")


def watched(index: int, body: FlexibleBody, frequency: float) -> Watched:
    """Return the constants of a body for the check."""
    reduced = body.reduced
    turning = [np.asarray(interface.Psi[3:]) for interface in body.moved.interfaces if interface.has_rotation]
    scaled, norms = scaled_unit_loads(reduced)
    return Watched(
        index=index,
        body=body,
        limits=replace(
            STIFFENED if body.is_stiffened else LINEAR, inertia=LEFT_OUT if reduced.moments.missing else np.inf
        ),
        frequency=frequency,
        Psi_r=np.concatenate(turning) if turning else np.zeros((0, reduced.n_q)),
        scaled=scaled,
        norms=norms,
    )


def scaled_unit_loads(reduced: ReducedBody) -> tuple[Array, Array]:
    """Return K^(-1/2) K_j K^(-1/2) for all unit loads, (n_loads, n_q²), with norms; empty if K is singular."""
    n, geometric = reduced.n_q, reduced.geometric
    values, vectors = la.eigh(reduced.K)
    if not values[0] > 0:
        return np.zeros((0, n * n)), np.zeros(0)
    root = vectors / np.sqrt(values)
    if geometric is None:
        K = np.concatenate([np.zeros((N_INERTIAL, n, n)), estimated_interface_loads(reduced).reshape(-1, n, n)])
    else:
        of_interfaces = np.zeros((len(reduced.interfaces), 6, n, n))
        if not all(geometric.is_loaded):
            of_interfaces[:] = estimated_interface_loads(reduced)
        of_interfaces[geometric.loaded] = geometric.interfaces
        K = np.concatenate([geometric.translation, geometric.rotation, geometric.spin, of_interfaces.reshape(-1, n, n)])
    scaled = root.T @ K @ root
    return scaled.reshape(len(K), n * n), np.abs(np.linalg.eigvalsh(scaled)).max(axis=1)


def estimated_interface_loads(reduced: ReducedBody) -> Array:
    """Return estimated matrices for unit interface wrenches, (n_interfaces, 6, n, n), for a body without them.

    A force N along the line e of length l from the centre of mass to an interface does the work -N l/2 times the mean
    square of the slopes between them. This mean square is taken as half the square of the slope at the interface, as
    for a half sine.
    """
    n, center = reduced.n_q, reduced.moments.center_of_mass
    K = np.zeros((len(reduced.interfaces), 6, n, n))
    for own, interface in zip(K, reduced.interfaces, strict=True):
        arm = np.asarray(interface.position) - center
        length = float(np.linalg.norm(arm))
        if length > 0:
            e = arm / length
            slopes = np.cross(e, np.asarray(interface.Psi[3:]), axisb=0)
            own[:3] = e[:, None, None] * (length / 2 * slopes @ slopes.T)
    return K


# whether the rotations of bushings and of public elements stay where small angles are meant ---------------------------
# A bushing with stiffness, damping or preload about its axes uses the components of the rotation vector theta of its
# marker B relative to A. Its coefficients may have been measured in Cardan angles, which differ from these components
# by about half the products of two of them: hardly for rotations about one axis, however large, and more and more for
# rotations about two. Near a full turn even a small tilt gives a large component.
#
# Public elements themselves state by how much their angles exceed small ones (`Element.small_angles`).


ANGLES_LIMIT = 0.05  #: allowed relative difference between rotation vector and Cardan angles

Measure = Callable[[Rows], Array]


def angle_measures(system: System) -> Iterator[tuple[str, str, Measure]]:
    """Yield name, kind ("angles" or "tilt") and deviation of each bushing and bearing with angles.

    Each measure is a function of rows of results, (n_t,).
    """
    compiled = compiled_system(system)
    bushings = [force for force in system.forces if isinstance(force, Bushing)]
    first = first_angles(system, len(compiled.angles))
    for bushing, k in zip(bushings, first, strict=True):
        if bushing.has_angles:
            a, b = bushing_markers(system, bushing, compiled.placed)
            yield f"forces.{bushing.name}", "angles", partial(apart_from_cardan, a, b, k)
    for placed in compiled.laws:
        beyond = placed.element.small_angles()
        if beyond is not None:
            yield f"elements.{placed.element.name}", "tilt", partial(of_element, beyond, tuple(placed.markers))


def apart_from_cardan(a: MarkerData, b: MarkerData, k: int, rows: Rows) -> Array:
    """Return the relative difference between rotation vector and Cardan angles of b relative to a, (n_t,).

    k: index of its first component among the counted angles; -1 if the components are not counted.
    """
    if k >= 0:
        theta = rows.angle[:, k : k + 3]
    else:
        theta = rotations_between(orientations_of(b, rows), orientations_of(a, rows))
    size = np.abs(theta)
    products = np.max([size[:, 0] * size[:, 1], size[:, 1] * size[:, 2], size[:, 2] * size[:, 0]], axis=0)
    angle = np.linalg.norm(theta, axis=1)
    return np.asarray(0.5 * products / np.where(angle > 0.0, angle, 1.0))


def of_element(beyond: Callable[[Array], Array], markers: tuple[MarkerData, ...], rows: Rows) -> Array:
    """Return the relative error of the small-angle terms of an element (`Element.small_angles`) by row, (n_t,)."""
    return beyond(np.stack([rotation_matrix(orientations_of(marker, rows)) for marker in markers], axis=1))


def orientations_of(marker: MarkerData, rows: Rows) -> Array:
    """Return the Euler parameters of a marker's axes on the undeformed body, (n_t, 4)."""
    p = euler_parameters(np.asarray(marker.shape.triad))
    if marker.body < 0:
        return np.broadcast_to(p, (len(rows.t), 4))
    return euler_parameter_product(rows.p[:, marker.body], p)
