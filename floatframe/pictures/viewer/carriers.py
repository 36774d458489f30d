"""Carriers of the pieces of a drawing (bodies, markers, interfaces), and their positions in their bodies over time."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.markers import MarkerData
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape, interface_shape
from floatframe.model.bodies.markers import Marker
from floatframe.model.rotations import rotated, rotation_log, rotation_matrix
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["GROUND_CARRIER", "Carrier", "Carriers"]

GROUND_CARRIER = 0  #: index of the first carrier, the ground


@dataclass(frozen=True, eq=False)
class Carrier:
    """A point with axes in a body: rho = position + d, axes = exp(theta) axes; (d, theta) is its motion in the body."""

    body: int  #: index of the body, -1 for the ground
    position: Array  #: position on the undeformed body, body frame, (3,) [m]
    axes: Array  #: axes on the undeformed body as columns, (3, 3)
    motion: Array | None = None  #: (d, theta) in the shown rows, (n, 6); None: at rest in its body
    psi: Array | None = None  #: derivative of (d, theta) by the modal coordinates, (6, n_q); None: at rest in its body


@dataclass
class Carriers:
    """All carriers of a drawing, without repetition."""

    trajectory: Trajectory
    rows: IntArray  #: rows of the motion that are shown
    system: System | None
    found: list[Carrier] = field(default_factory=lambda: [Carrier(-1, np.zeros(3), np.eye(3))])
    numbers: dict[object, int] = field(default_factory=dict)  #: indices of the carriers requested so far

    def of_body(self, body: int) -> int:
        """Return the index of the carrier that is the frame of a body."""
        return self.of_shape(body, MarkerShape(np.zeros(3), np.eye(3)))

    def of_shape(self, body: int, shape: MarkerShape) -> int:
        """Return the index of a marker in the frame of its file."""
        if shape.psi is None and body < 0 and not shape.position.any() and np.array_equal(shape.triad, np.eye(3)):
            return GROUND_CARRIER
        key = (body, shape.position.tobytes(), shape.triad.tobytes(), shape.psi is None)
        if key not in self.numbers:
            motion = None
            if shape.psi is not None:
                name = self.trajectory.body_names[body]
                motion = shape.deformation(self.trajectory.body(name).q[self.rows])
            self.add(key, Carrier(body, shape.position, shape.triad, motion, shape.psi))
        return self.numbers[key]

    def of_marker(self, given: object, end: MarkerData) -> int:
        """Return the index of a marker of a joint or force, from its description and its data."""
        assert self.system is not None  # ensured, because it contains the joint
        body = self.system.bodies[end.body] if end.body >= 0 else None
        if isinstance(body, FlexibleBody) and body.mean_axes is not None:
            if isinstance(given, Marker) and given.interface is not None:
                shape = interface_shape(body.reduced, given.interface, is_stiffened=body.is_stiffened)
                triad = shape.triad if given.triad is None else shape.triad @ given.triad
                return self.of_shape(end.body, MarkerShape(shape.position, triad, shape.psi, shape.bend))
            return self.followed(end)
        return self.of_shape(end.body, end.shape)

    def followed(self, end: MarkerData) -> int:
        """Return the index of a marker known only in the frame of the engine, from its motion."""
        assert self.system is not None
        key = ("followed", end.body, end.shape.position.tobytes(), end.shape.triad.tobytes())
        if key not in self.numbers:
            motion = self.trajectory.body(self.trajectory.body_names[end.body])
            place, R = end_motion(self.system, self.trajectory, end), rotation_matrix(motion.p[self.rows])
            back = np.swapaxes(R, -1, -2)
            rho = rotated(back, place.position[self.rows] - motion.r[self.rows])
            axes = back @ place.axes[self.rows]
            theta = rotation_log(axes @ axes[0].T)
            self.add(key, Carrier(end.body, rho[0], axes[0], np.concatenate([rho - rho[0], theta], axis=1)))
        return self.numbers[key]

    def add(self, key: object, carrier: Carrier) -> None:
        """Store a carrier."""
        self.numbers[key] = len(self.found)
        self.found.append(carrier)
