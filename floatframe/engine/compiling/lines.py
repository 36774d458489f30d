"""Sliding joints as the kernels see them: their lines, stations and sliding markers."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.bodies import integers, offsets
from floatframe.engine.compiling.connections import Connections, End
from floatframe.engine.compiling.markers import find_marker, joint_markers, marker_pose
from floatframe.engine.kernels import model
from floatframe.engine.kernels.model import JOINT
from floatframe.engine.kernels.records import filled
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.joints.rows import MOMENT, NO_MOMENT
from floatframe.model.joints.sliding import SlidingJoint, line_triad
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System

__all__ = ["Lines", "add_sliding"]


@dataclass
class Lines:
    """Lists over the lines, and over their stations."""

    marker: list[int] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    axis: list[Array] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    s: list[float] = field(default_factory=list)
    station: list[int] = field(default_factory=list)

    def records(self) -> dict[str, Any]:
        """Return the parts of the model."""
        return {
            "lines": filled(
                model.Lines(),
                marker=self.marker,
                other=[m + 1 for m in self.marker],
                row=self.row,
                axis=self.axis,
                station0=offsets(integers(self.counts)),
            ),
            "stations": filled(model.Stations(), s=self.s, marker=self.station),
        }

    def of_markers(self, n_markers: int) -> IntArray:
        """Return the line along which each marker slides, -1 for none."""
        line = np.full(n_markers, -1, np.int64)
        line[self.marker] = np.arange(len(self.marker))
        return line


def add_sliding(system: System, made: Connections, lines: Lines, joint: SlidingJoint) -> None:
    """Add a sliding joint, the markers of its stations and its line."""
    where = f"joint {joint.name!r}"
    first, b = joint_markers(system, joint, made.placed)
    name = body_name(joint.marker_a.body)
    if not isinstance(system.body(name), FlexibleBody):
        raise ModelError(f"{where}: body {name!r} is not flexible; take a prismatic joint or a point on a line")
    stations = [find_marker(system, f"{where}: line", Marker(name, station)) for station in joint.stations]
    s, triad = line_triad(where, np.array([m.shape.position for m in stations]), joint.normal)
    _, A_b = marker_pose(b, made.placed, made.n_q)
    A_line = rotation_matrix(made.placed.p[first.body]) @ triad
    assert first.shape.psi is not None
    sliding = replace(first, shape=MarkerShape(stations[0].shape.position, triad, np.array(first.shape.psi)))
    rows = joint.rows(A_line, A_b, np.zeros(3))
    ends = (
        End(sliding, 1.0, moment=MOMENT if joint.is_aligned else NO_MOMENT),
        End(b, -1.0, moment=joint.moment_b),
    )
    marker, row = made.add(joint.name, JOINT, ends, rows, has_rates=False)
    lines.marker.append(marker)
    lines.row.append(row + 2 if joint.motions else -1)
    lines.axis.append(triad[:, 0])
    lines.counts.append(len(stations))
    lines.s += list(s)
    lines.station += [made.add_marker(station) for station in stations]
