"""Small motions about an equilibrium or a steady rotation, for sensors and channels.

The unknowns are x = (xi, s). xi consists, for each body, of translation and rotation of its frame in body axes and its
modal coordinates, in the frame in which the engine computes it. s are the motions prescribed by inputs, of bases (the
ground side of connections) and of drives. All quantities are in axes that rotate with the steady motion and coincide
with ground axes now. `SmallPlace` is the motion of a marker for all sensors and elements.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.file_frames import small_motions_of_file
from floatframe.engine.compiling.markers import MarkerData, marker_pose, n_q_of
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.work import Work
from floatframe.errors import ModelError
from floatframe.model.rotations import rotation_matrix, tilde
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.small_motions.joint_rates import coordinate_rows
from floatframe.results.small_motions.marker_jacobian import marker_jacobian
from floatframe.results.small_motions.rows import Rows
from floatframe.results.trajectory import Trajectory

__all__ = ["BaseColumn", "InputForce", "SmallMotions", "SmallPlace"]


@dataclass(frozen=True, eq=False)
class BaseColumn:
    """The motion prescribed by an input: a rigid motion of the ground side of some connections (none for a drive)."""

    moved: frozenset[str] = frozenset()  #: names of the connections that move
    translation: Array | None = None  #: translation, ground axes, (3,); None: zero
    rotation: Array | None = None  #: rotation vector, ground axes, (3,); None: zero
    about: Array | None = None  #: centre of the rotation, ground axes, (3,); None: the origin

    def at(self, point: Array) -> Array:
        """Return translation and rotation at a point, ground axes, (6,)."""
        d = np.zeros(3) if self.translation is None else self.translation
        turn = np.zeros(3) if self.rotation is None else self.rotation
        arm = point - (np.zeros(3) if self.about is None else self.about)
        return np.concatenate([d + np.cross(turn, arm), turn])


@dataclass(frozen=True, eq=False)
class InputForce:
    """Force and moment of a unit input at an interface of a flexible body, or a load case on the body."""

    body: str
    interface: str  #: name of the interface, empty for a load case
    wrench: Array  #: force and moment, ground axes, (6,)
    load_case: str = ""


@dataclass(frozen=True, eq=False)
class SmallPlace:
    """A point with axes, and its linearised motion in axes that rotate with the steady motion at Omega.

    With p = p_0 + J x, and theta the rotation of the axes, the absolute motion is

        velocity          p' + Omega × p       acceleration          (p' + Omega × p)' + Omega × (p' + Omega × p)
        angular velocity  Omega + theta'       angular acceleration  theta'' + Omega × theta'
    """

    position: Array  #: position of the point, ground axes, (3,)
    axes: Array  #: axes at the point as columns, (3, 3)
    moved: Rows  #: linearised translation of the point, as three rows
    rotation: Rows  #: linearised rotation of the axes in ground axes, as three rows
    spin: Array  #: angular velocity Omega of the steady rotation, ground axes, (3,) [rad/s]

    def in_axes(self, rows: Rows, value: Array) -> Rows:
        """Return the rows of a vector in the axes A of the place, d(Aᵀ v) = Aᵀ (dv + v × theta), from dv and v."""
        return (rows + self.rotation.mapped(tilde(value))).mapped(self.axes.T)

    def absolute_rate(self, rows: Rows) -> Rows:
        """Return the rate in ground axes of a vector with the given rows in rotating axes."""
        return rows.rate + rows.mapped(tilde(self.spin))

    @property
    def velocity(self) -> Rows:
        """The velocity of the point, three rows."""
        return self.absolute_rate(self.moved)

    @property
    def acceleration(self) -> Rows:
        """The acceleration of the point, three rows."""
        return self.absolute_rate(self.velocity)

    @property
    def omega(self) -> Rows:
        """The angular velocity of the axes, three rows."""
        return self.rotation.rate

    @property
    def alpha(self) -> Rows:
        """The angular acceleration of the axes, three rows."""
        return self.absolute_rate(self.omega)


@dataclass(frozen=True, eq=False)
class SmallMotions:
    """A steady motion with the small motions about it."""

    system: System
    compiled: CompiledSystem
    work: Work  #: working arrays, evaluated at the steady motion
    state: State  #: state in the frames of the engine
    omega: Array  #: angular velocity of the steady rotation, ground axes, (3,) [rad/s]
    now: Trajectory  #: the steady motion as a trajectory with one time, for sensors
    bases: tuple[BaseColumn, ...] = ()  #: motion of the ground for each input
    forces: tuple[tuple[InputForce, ...], ...] = ()  #: forces at interfaces for each input

    @property
    def n_u(self) -> int:
        """Number of small motions of the bodies."""
        return int(self.compiled.model.bodies.u0[-1])

    @property
    def n_x(self) -> int:
        """Number of small motions of bodies and inputs."""
        return self.n_u + len(self.bases)

    @property
    def n_w(self) -> int:
        """Number of wrench components."""
        return int(self.compiled.model.connections.w0[-1])

    @property
    def is_turning(self) -> bool:
        """Whether the steady motion is a rotation."""
        return bool(self.omega.any())

    @property
    def speed_scale(self) -> float:
        """Largest speed in the steady motion, zero at rest [length/s]."""
        return float(np.linalg.norm(self.omega)) * self.compiled.length

    def by_motion(self, x: Array) -> Rows:
        """Return rows of small motions from coefficients of body motions, (n, n_u), or of all motions, (n, n_x)."""
        x = np.atleast_2d(x)
        whole = np.zeros((len(x), self.n_x))
        whole[:, : x.shape[1]] = x
        zero = np.zeros_like(whole)
        return Rows(whole, zero, zero, np.zeros((len(x), self.n_w)))

    def by_wrench(self, rows: Sequence[int] | slice, factor: float = 1.0) -> Rows:
        """Return rows with wrench components multiplied by a factor."""
        w = factor * np.eye(self.n_w)[rows]
        zero = np.zeros((len(w), self.n_x))
        return Rows(zero, zero, zero, w)

    def pose(self, end: MarkerData) -> tuple[Array, Array]:
        """Return position (3,) and axes (3, 3) of a marker, ground axes."""
        return marker_pose(end, self.state, n_q_of(self.system))

    def place(self, end: MarkerData, connection: str = "") -> SmallPlace:
        """Return a marker's linearised motion; on the ground it follows the moving bases of its connection."""
        position, axes = self.pose(end)
        x = np.zeros((6, self.n_x))
        if end.body >= 0:
            x[:, self.unknowns(end.body)] = marker_jacobian(self.compiled, self.work, end)
        else:
            for k, base in enumerate(self.bases):
                if connection in base.moved:
                    x[:, self.n_u + k] = base.at(position)
        rows = self.by_motion(x)
        return SmallPlace(position, axes, rows[:3], rows[3:], self.omega)

    def unknowns(self, body: int) -> slice:
        """Return the index range of a body's small motions."""
        u0 = self.compiled.model.bodies.u0
        return slice(int(u0[body]), int(u0[body + 1]))

    def of_file(self, name: str) -> tuple[Rows, Array]:
        """Return rows of a body's small motions in the frame of its file, (6 + n_q), and R_GB of that frame."""
        i = self.compiled.body_names.index(name)
        x = np.zeros((6 + int(self.compiled.model.bodies.n_q[i]), self.n_x))
        x[:, self.unknowns(i)] = small_motions_of_file(self.compiled, self.state.q)[i]
        return self.by_motion(x), rotation_matrix(self.now.body(name).p[0])

    def coordinates(self, name: str) -> Rows:
        """Return n_q rows of a body's modal coordinates in the frame of its file."""
        return self.of_file(name)[0][6:]

    def frame_place(self, name: str) -> SmallPlace:
        """Return the linearised motion of a body's file frame."""
        rows, R = self.of_file(name)
        return SmallPlace(self.now.body(name).r[0], R, rows[:3].mapped(R), rows[3:6].mapped(R), self.omega)

    def joint_coordinate(self, joint: str, coordinate: str, where: str) -> Array:
        """Return the derivative of a joint coordinate by body motions, (n_u,); `ModelError` if it is missing."""
        rows = coordinate_rows(self.system, self.compiled, self.work, self.state)
        name = f"{joint}.{coordinate}"
        if name not in rows:
            raise ModelError(f"{where}: no joint coordinate {quoted(name)}{nearest(name, list(rows))}")
        return rows[name]

    def rigid(self, base: BaseColumn) -> Array:
        """Return the small motions of all bodies, (n_u,), that move rigidly together with a base."""
        x = np.zeros(self.n_u)
        for i, (r, R) in enumerate(zip(self.work.state.r, self.work.state.R, strict=True)):
            u0 = self.unknowns(i).start
            motion = base.at(r)
            x[u0 : u0 + 3], x[u0 + 3 : u0 + 6] = R.T @ motion[:3], R.T @ motion[3:]
        return x

    def wrench(self, connection: str) -> slice:
        """Return the index range of a connection's wrench."""
        c = self.compiled.connection_names.index(connection)
        w0 = self.compiled.model.connections.w0
        return slice(int(w0[c]), int(w0[c + 1]))

    @property
    def largest_wrench(self) -> float:
        """Largest present component of all wrenches, the reference for rounding errors."""
        return float(np.abs(self.work.state.w).max(initial=0.0))
