"""Named stress points at the ends of chosen lines (`fe_models.body.fe_body.StressPointModel`)."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["SectionPoints", "section_points"]


@dataclass(frozen=True, eq=False)
class SectionPoints:
    """Section points at both ends of some lines. Each has the stress of its own element, without averaging."""

    model: BeamModel
    lines: IntArray  #: indices of the chosen lines, (n_lines,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lines", frozen(self.lines, np.int64))

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each point, such as "line 3 start point 0", (n_points,)."""
        return tuple(
            f"line {line} {end} point {point}"
            for line in self.lines
            for end in ("start", "end")
            for point in range(len(self._section(line).points))
        )

    @property
    def positions(self) -> Array:
        """Undeformed positions in mesh axes, (n_points, 3) [m]."""
        geometry = self.model.geometry
        return frozen(
            np.concatenate(
                [
                    geometry.ends[line, end] + self._section(line).points @ geometry.R[line][:, 1:].T
                    for line in self.lines
                    for end in range(2)
                ]
            )
        )

    def stress(self, u: Array) -> Array:
        """Return the stress for columns over the mesh dofs, (n_points, 6, k) [Pa], xx yy zz yz xz xy in mesh axes."""
        forces = self.model.section_forces(u)
        return np.concatenate(
            [
                self.model.stress_at_end(np.array([line]), forces[[line], end])[0]
                for line in self.lines
                for end in range(2)
            ]
        )

    def _section(self, line: int) -> SectionProperties:
        return self.model.sections[self.model.of_line[line]]


def section_points(body: FEBody, lines: Iterable[int]) -> FEBody:
    """Return the body with named stress points at the ends of these lines.

    Parameters
    ----------
    body
        Body made by `beam_body`, coupled or not.
    lines
        Indices of lines in `LineMesh.lines`.

    Raises
    ------
    BeamError
        If the body is not a frame, or a line does not exist.
    """
    model = body.element_model
    chosen = np.array(list(lines), dtype=np.int64)
    if not isinstance(model, BeamModel):
        raise BeamError(f"section_points: body {body.name!r} is not a frame of beams; choose the points before welding")
    n = len(model.of_line)
    if not len(chosen) or chosen.min() < 0 or chosen.max() >= n:
        raise BeamError(f"section_points: body {body.name!r}: expected lines 0..{n - 1}, got {chosen.tolist()[:5]}")
    return replace(body, stress_points=SectionPoints(model, chosen))
