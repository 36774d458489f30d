"""Equations of a system in the coordinates of its tree, by recursion over bodies (docs/recursive.md)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import quoted
from floatframe.engine.compiling.file_frames import state_of_engine, state_of_file
from floatframe.engine.compiling.markers import find_marker
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.tree.recursion.entry import FORWARD, INVERSE, MASS, PLACE, SOLVE, TANGENTS, Prepared
from floatframe.engine.tree.recursion.expansion import Expansion, expansion_of, positions_and_rates_of_state
from floatframe.engine.tree.recursion.nodes import ROTATION, Dense, NodeWork, new_dense, new_node_work
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.forces import Gravity
from floatframe.model.rotations import (
    cross,
    euler_parameter_product,
    euler_parameters,
    euler_parameters_of_rotation_vector,
)
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["AccelerationDerivatives", "ForceDerivatives", "RelativeModel", "relative_model"]

UNIT_DEFECT = 1e-6  #: allowed difference of the norm of Euler parameters from one


class ForceDerivatives(NamedTuple):
    """Derivatives of the forces of a motion, each (n_rates, n_rates); row: force, column: coordinate."""

    #: derivative by positions in the directions of the rates, at fixed rates and accelerations [N/rad, ...]
    by_z: Array
    by_z_dot: Array
    by_z_ddot: Array  #: derivative by accelerations: the mass matrix


class AccelerationDerivatives(NamedTuple):
    """Derivatives of accelerations at given forces, each (n_rates, n_rates); row: acceleration, column: coordinate."""

    by_z: Array  #: derivative by positions in the directions of the rates, at fixed rates and forces
    by_z_dot: Array
    by_force: Array  #: derivative by forces, M⁻¹


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RelativeModel:
    """Equations of a tree of rigid and flexible bodies by recursion, M(z) z_ddot + h(z, z_dot) = forces.

    Positions z, (n_z,), rates z_dot, accelerations and forces, (n_rates,), are ordered by bodies, in the order of the
    system: first those of the joint that carries the body, in the order of its coordinates, then its modal coordinates.
    An angle is zero for the joint as placed, a distance if the points coincide. A spherical joint has four positions,
    the Euler parameters (w, x, y, z) of the axes of marker B relative to marker A, and three rates, the angular
    velocity of B relative to A in axes of B. A free body has the position of its frame origin and the Euler parameters
    of R_GB, with its velocity in ground axes and its angular velocity in body axes. Derivatives by z are taken along
    the rates: rotations change by R exp(dz). `names` and `rate_names` name each number.

    The working arrays belong to the model: two threads need two.

    Parameters
    ----------
    expansion
        Nodes of the tree, and the relation of their numbers to the bodies.
    work
        Results of the recursions.
    marker_work
        Working arrays of the markers and forces.
    ready
        Records of the tree.
    """

    expansion: Expansion
    work: NodeWork = field(repr=False)
    marker_work: Work = field(repr=False)
    ready: Prepared = field(repr=False)

    @property
    def n_z(self) -> int:
        """Number of positions."""
        return self.expansion.n_x

    @property
    def n_rates(self) -> int:
        """Number of rates, of accelerations and of forces."""
        return self.expansion.n_v

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the positions: each names a joint (or free body) and its coordinate, or a body and its mode."""
        return self.named(is_position=True)

    @cached_property
    def rate_names(self) -> tuple[str, ...]:
        """Names of the rates, accelerations and forces."""
        return self.named(is_position=False)

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the coordinates that functions of time prescribe."""
        return tuple(each.name for each in self.expansion.tree.columns if each.is_driven)

    def named(self, *, is_position: bool) -> tuple[str, ...]:
        """Return the names of positions or rates."""
        expansion = self.expansion
        tree, names = expansion.tree.tree, []
        columns = sorted(expansion.tree.columns, key=lambda each: expansion.compiled.body_names.index(each.body))
        for i, body in enumerate(expansion.compiled.body_names):
            own = [each.name for each in columns[tree.column0[i] : tree.column0[i + 1]]]
            x = expansion.x_of[i]
            if is_position and x.stop - x.start > len(own):
                stem = own[-1].rsplit("/", 1)[0]
                own = own[:-3] + [f"{stem}/euler parameter {letter}" for letter in "wxyz"]
            names += own
            names += [f"{body}/mode {k + 1}" for k in range(expansion.xq_of[i].stop - expansion.xq_of[i].start)]
        return tuple(names)

    def inverse_dynamics(
        self, z: Array, z_dot: Array, z_ddot: Array, *, wrenches: Mapping[Marker, Array] | None = None
    ) -> Array:
        """Return the forces along all coordinates for a given motion, (n_rates,) [N, N m; modes: N m^(1/2)].

        The recursive Newton-Euler method takes a time proportional to the number of bodies: Walker & Orin (1982); for
        bodies in floating frames see docs/recursive.md §2. All joints count as driven. Modes have their own stiffness
        and damping, so that their entries are zero in a motion without modal loads.

        Parameters
        ----------
        z
            Positions, (n_z,) [m, rad, 1].
        z_dot, z_ddot
            Rates and accelerations, (n_rates,).
        wrenches
            External forces and moments at markers, each (6,) [N, N m] in ground axes.

        Raises
        ------
        ModelError
            If an array has another length or is not finite, or if Euler parameters do not have unit length.
        """
        self.take(z, z_dot, z_ddot)
        self.run(INVERSE)
        force = self.work.force.copy()
        for marker, wrench in (wrenches or {}).items():
            force -= self.jacobian(z, marker).T @ checked(f"wrench at {marker!r}", wrench, 6)
        return force

    def reactions(
        self, z: Array, z_dot: Array, z_ddot: Array, *, wrenches: Mapping[Marker, Array] | None = None
    ) -> Array:
        """Return the wrench of the joint on each body, (n_bodies, 6): force and moment [N, N m], ground axes.

        Moments are about the point of the marker on the body (the frame origin of a free body). Drives along the
        coordinates of the joint are included. Arguments as in `inverse_dynamics`.
        """
        self.take(z, z_dot, z_ddot)
        self.run(INVERSE)
        own = [self.work.reaction[k].copy() for k in self.expansion.node_of]
        self.run(PLACE)
        result = np.zeros((len(own), 6))
        for i, k in enumerate(self.expansion.node_of):
            axes = self.work.R_G[k] @ self.work.R_own[k]
            result[i] = np.concatenate([axes @ own[i][:3], axes @ own[i][3:]])
        for marker, wrench in (wrenches or {}).items():
            wrench = checked(f"wrench at {marker!r}", wrench, 6)
            i = find_marker(self.expansion.system, "reactions", marker).body
            r, _ = self.pose(z, marker)
            while i >= 0:
                k = self.expansion.node_of[i]
                point = self.work.r_G[k] + self.work.R_G[k] @ self.own_arm(k)
                result[i] -= np.concatenate([wrench[:3], wrench[3:] + cross(r - point, wrench[:3])])
                i = int(self.expansion.tree.tree.parent[i])
        return result

    def mass_matrix(self, z: Array) -> Array:
        """Return the symmetric mass matrix M(z), (n_rates, n_rates), by composite bodies (Featherstone 2008, ch. 6)."""
        self.take(z)
        self.run(MASS)
        return self.dense.M.copy()

    def forward_dynamics(
        self, z: Array, z_dot: Array, force: Array | None = None, *, wrenches: Mapping[Marker, Array] | None = None
    ) -> Array:
        """Return the accelerations for given forces along the coordinates, (n_rates,).

        The method of articulated bodies takes a time proportional to the number of bodies; it eliminates the modal
        coordinates body by body (Featherstone 2008, chapter 7; docs/recursive.md §4).

        Parameters
        ----------
        z, z_dot
            Positions (n_z,) and rates (n_rates,).
        force
            Forces along the coordinates, (n_rates,); None: zero.
        wrenches
            As in `inverse_dynamics`.

        Raises
        ------
        ModelError
            If a coordinate is prescribed by a function of time, or the subtree of a joint has no inertia along it.
        """
        if self.driven:
            raise ModelError(
                f"forward_dynamics: coordinate {quoted(self.driven[0])} is prescribed by a function of time; "
                "leave out the motion of its joint, or integrate the system"
            )
        given = np.zeros(self.n_rates) if force is None else checked("forward_dynamics: force", force, self.n_rates)
        for marker, wrench in (wrenches or {}).items():
            given = given + self.jacobian(z, marker).T @ checked(f"wrench at {marker!r}", wrench, 6)
        self.take(z, z_dot)
        self.work.force_given[:] = given
        self.run(FORWARD)
        return self.work.right.copy()

    def solve(self, z: Array, right: Array) -> Array:
        """Return M(z)⁻¹ right, (n_rates,) or (n_rates, m), by articulated bodies factorised once."""
        self.take(z)
        columns = np.asarray(right, dtype=float)
        n = self.n_rates
        if columns.ndim not in (1, 2) or len(columns) != n or not np.isfinite(columns).all():
            raise ModelError(f"solve: right: expected {n} finite rows, got shape {columns.shape}")
        rows = np.ascontiguousarray(columns.reshape(n, -1).T)
        dense = self.none._replace(columns=rows.copy())
        self.require(self.ready.run(SOLVE, dense))
        return np.asarray(dense.columns.T.reshape(columns.shape))

    def derivatives(self, z: Array, z_dot: Array, z_ddot: Array) -> "ForceDerivatives":
        """Return exact derivatives of `inverse_dynamics`, without external wrenches, by recursion.

        They are derivatives by positions along the rates (rotations: R exp(dz)), by rates and by accelerations, see
        docs/recursive.md §5, after Carpentier & Mansard (2018) and Singh, Russell & Wensing (2022).
        """
        self.take(z, z_dot, z_ddot)
        self.run(TANGENTS)
        return ForceDerivatives(self.dense.by_z.copy(), self.dense.by_rate.copy(), self.dense.M.copy())

    def forward_derivatives(self, z: Array, z_dot: Array, force: Array | None = None) -> "AccelerationDerivatives":
        """Return derivatives of `forward_dynamics`: -M⁻¹ times derivatives of the forces, and M⁻¹."""
        z_ddot = self.forward_dynamics(z, z_dot, force)
        forces = self.derivatives(z, z_dot, z_ddot)
        solved = self.solve(z, np.hstack([-forces.by_z, -forces.by_z_dot, np.eye(self.n_rates)]))
        return AccelerationDerivatives(*np.hsplit(solved, 3))

    def state(self, z: Array, z_dot: Array | None = None) -> State:
        """Return positions and velocities of all bodies in the frames of their files."""
        return state_of_file(self.expansion.compiled, self.engine_state(z, z_dot))

    def engine_state(self, z: Array, z_dot: Array | None = None) -> State:
        """Return positions and velocities of all bodies in frames of the engine (mean axes for stiffened bodies)."""
        self.take(z, np.zeros(self.n_rates) if z_dot is None else z_dot)
        self.run(PLACE)
        e, w = self.expansion, self.work
        r, p, q, u = [], [], [], []
        for i, k in enumerate(e.node_of):
            place, R = self.frame(i)
            arm, v, omega = place - w.r_G[k], w.motion[k, :3], w.motion[k, 3:]
            r.append(place)
            p.append(euler_parameters(R))
            q.append(w.x[e.xq_of[i]])
            u += [v + cross(omega, arm), R.T @ omega, w.v[e.vq_of[i]]]
        return State(r=np.array(r), p=np.array(p), q=np.concatenate(q), u=np.concatenate(u))

    def positions(self, state: State | None = None) -> tuple[Array, Array]:
        """Return z, (n_z,), and z_dot, (n_rates,), for a state of the bodies; None: the assembled state.

        Joints are assumed to be closed, angles are between -pi and pi, and rates fit the velocities at each joint by
        least squares.
        """
        e = self.expansion
        engine = e.compiled.placed if state is None else state_of_engine(e.compiled, state)
        return positions_and_rates_of_state(e, engine)

    def moved(self, z: Array, dz: Array) -> Array:
        """Return z after a displacement dz along the rates, (n_rates,); rotations use the exponential map."""
        x, dx = checked("moved: z", z, self.n_z).copy(), checked("moved: dz", dz, self.n_rates)
        nodes, e = self.expansion.nodes, self.expansion
        for kind, n, x0, v0 in zip(nodes.kind, nodes.n_z, nodes.x0, nodes.v0, strict=True):
            if kind == ROTATION:
                turn = euler_parameters_of_rotation_vector(dx[v0 : v0 + 3])
                x[x0 : x0 + 4] = euler_parameter_product(x[x0 : x0 + 4], turn)
            else:
                x[x0 : x0 + n] += dx[v0 : v0 + n]
        for xq, vq in zip(e.xq_of, e.vq_of, strict=True):
            x[xq] += dx[vq]
        return x

    def pose(self, z: Array, marker: Marker) -> tuple[Array, Array]:
        """Return position (3,) [m] and axes (3, 3) of a marker in the ground."""
        found = find_marker(self.expansion.system, "pose", marker)
        self.take(z)
        self.run(PLACE)
        q = self.work.x[self.expansion.xq_of[found.body]] if found.body >= 0 else np.zeros(0)
        rho, axes = found.shape.pose(q)
        r, R = self.frame(found.body)
        return np.asarray(r + R @ rho), np.asarray(R @ axes)

    def jacobian(self, z: Array, marker: Marker) -> Array:
        """Return the matrix from rates to velocity and angular velocity of a marker, ground axes, (6, n_rates)."""
        found = find_marker(self.expansion.system, "jacobian", marker)
        self.take(z)
        self.run(PLACE)
        J = np.zeros((6, self.n_rates))
        if found.body < 0:
            return J
        e, w, nodes = self.expansion, self.work, self.expansion.nodes
        q = w.x[e.xq_of[found.body]]
        r, R = self.frame(found.body)
        point = r + R @ found.shape.pose(q)[0]
        own = found.shape.jacobian(q)[:, 6:]
        J[:3, e.vq_of[found.body]], J[3:, e.vq_of[found.body]] = R @ own[:3], R @ own[3:]
        k = e.node_of[found.body]
        while k >= 0:
            rates = slice(nodes.v0[k], nodes.v0[k] + nodes.n_z[k] + nodes.n_q[k])
            J[:, rates] += shifted(w.S[rates], point - w.r_G[k]).T
            above = int(nodes.parent[k])
            if nodes.above[k] >= 0:
                modes = slice(nodes.vq[above], nodes.vq[above] + nodes.n_q[above])
                J[:, modes] += shifted(w.above[nodes.c0[k] : nodes.c0[k + 1]], point - w.r_G[k]).T
            k = above
        return J

    def own_arm(self, k: int) -> Array:
        """Return the vector from the origin of node k to its joint, node axes, (3,)."""
        m = int(self.expansion.nodes.own[k])
        return np.zeros(3) if m < 0 else self.marker_work.markers.rho[m]

    def frame(self, i: int) -> tuple[Array, Array]:
        """Return origin (3,) and axes (3, 3) of body i at its last placement; -1: of the ground."""
        if i < 0:
            return np.zeros(3), np.eye(3)
        k = self.expansion.node_of[i]
        if self.expansion.nodes.n_q[k]:
            return self.work.r_G[k], self.work.R_G[k]
        F, origin = self.expansion.frame_of[i]
        R = self.work.R_G[k] @ F.T
        return self.work.r_G[k] - R @ origin, R

    def take(self, z: Array, z_dot: Array | None = None, z_ddot: Array | None = None) -> None:
        """Write positions, rates and accelerations (None: zero) into the working arrays."""
        n, work = self.n_rates, self.work
        x = checked("z", z, self.n_z)
        for first in self.rotations:
            length = float(np.linalg.norm(x[first : first + 4]))
            if abs(length - 1) > UNIT_DEFECT:
                raise ModelError(
                    f"z: expected Euler parameters of length 1 at {first} to {first + 3} "
                    f"({quoted(self.names[first])} ...), got length {length:.9g}"
                )
        work.x[:] = x
        work.v[:] = 0.0 if z_dot is None else checked("z_dot", z_dot, n)
        work.a[:] = 0.0 if z_ddot is None else checked("z_ddot", z_ddot, n)

    @cached_property
    def rotations(self) -> tuple[int, ...]:
        """Indices of the first position of each rotation."""
        nodes = self.expansion.nodes
        return tuple(int(first) for first in nodes.x0[nodes.kind == ROTATION])

    @cached_property
    def none(self) -> Dense:
        """Empty matrices, for tasks that do not need matrices."""
        return new_dense(self.expansion.nodes, self.n_rates, 0, is_whole=False)

    @cached_property
    def dense(self) -> Dense:
        """Matrices with one row or column for each rate."""
        return new_dense(self.expansion.nodes, self.n_rates, 0, is_whole=True)

    def run(self, what: int, times: int = 1) -> None:
        """Run a task of the kernels; `ModelError` if a coordinate has no inertia."""
        self.require(self.ready.run(what, self.dense if what in (MASS, TANGENTS) else self.none, times))

    def require(self, node: int) -> None:
        """Raise `ModelError` if a node has no inertia along its rates."""
        if node >= 0:
            first = int(self.expansion.nodes.v0[node])
            raise ModelError(
                f"forward_dynamics: the subtree of {quoted(self.rate_names[first])} has no inertia along it in this "
                "position"
            )


def shifted(columns: Array, p: Array) -> Array:
    """Return motions (n, 6) transferred to a point at p."""
    return np.concatenate([columns[:, :3] + np.cross(columns[:, 3:], p), columns[:, 3:]], axis=1)


def checked(name: str, value: Array, n: int) -> Array:
    """Return a value as a vector; `ModelError` unless it has n finite numbers."""
    array = np.asarray(value, dtype=float)
    if array.shape != (n,) or not np.isfinite(array).all():
        got = f"shape {array.shape}" if array.shape != (n,) else "numbers that are not finite"
        raise ModelError(f"relative model: {name}: expected {n} finite numbers, got {got}")
    return array


def relative_model(system: System) -> RelativeModel:
    """Return the recursive equations of a system in the coordinates of its tree.

    They include gravity; other forces are arguments of the methods (`force`, `wrenches`).

    Parameters
    ----------
    system
        A tree of bodies on joints, with gravity as its only force.

    Raises
    ------
    ModelError
        If a joint closes a loop or has no coordinates of its own, or the system has other forces than gravity, couplers
        or elements.
    """
    where = f"relative_model: system {system.name!r}"
    others = [each for each in system.forces if not isinstance(each, Gravity)]
    for kind, named in (("force", others), ("coupler", system.couplers), ("element", system.elements)):
        if named:
            raise ModelError(
                f"{where}: expected bodies, joints and gravity, got {kind} {named[0].name!r}; give its forces "
                "to inverse_dynamics or forward_dynamics, or integrate the system"
            )
    found = tree_of(system)
    for names, why in ((found.cut, "closes a loop"), (found.constrained, "has no coordinates that place a body")):
        if names:
            raise ModelError(
                f"{where}: expected joints that form a tree, but joint {names[0]!r} {why}; take open_equations, or "
                'integrate with formulation = "relative"'
            )
    expansion = expansion_of(system)
    model = expansion.compiled.model
    work, marker_work = new_node_work(expansion.nodes, expansion.n_x, expansion.n_v), new_work(model)
    work.gravity[:] = model.gravity
    marker_work.state.R[:] = np.eye(3)
    return RelativeModel(expansion, work, marker_work, Prepared(expansion.nodes, work, model, marker_work))
