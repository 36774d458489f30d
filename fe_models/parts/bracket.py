"""Parametric bracket: a bolted foot, an upright with a bore, and a rib between them."""

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from fe_models.parts.errors import PartError
from fe_models.parts.gmsh_session import PartMesh, cylinder_faces, mesh_and_write, part_model
from fe_models.parts.lengths import require, require_lengths

__all__ = ["Bracket", "mesh_bracket"]


@dataclass(frozen=True)
class Bracket:
    """Dimensions of an L-shaped bracket, in any one length unit (defaults in mm).

    The foot lies on z = 0 and extends from x = 0 along +x. The upright stands on x = 0..thickness along +z. The bracket
    is symmetric about y = 0. Four bolts pass through the foot along z, and the bore passes through the upright along x.
    """

    foot_length: float = 90.0  #: length of the foot along x, including the thickness of the upright
    width: float = 70.0  #: width along y
    height: float = 110.0  #: height of the upright along z
    thickness: float = 10.0  #: thickness of foot and upright
    fillet: float = 8.0  #: fillet radius in the inner corner
    bolt: float = 9.0  #: diameter of the bolt holes
    bolt_edge: float = 14.0  #: distance from a bolt axis to the edge of the foot, or to the upright
    bore: float = 32.0  #: diameter of the bore
    bore_height: float = 80.0  #: height of the bore axis above z = 0
    rib_thickness: float = 8.0  #: rib thickness along y
    rib_length: float = 55.0  #: rib length along the foot, from the inner face of the upright
    rib_height: float = 42.0  #: rib height along the upright, from the upper face of the foot

    def __post_init__(self) -> None:
        require_lengths(self)
        t, r = self.thickness, self.bore / 2
        require(
            self,
            self.bolt < t + self.bolt_edge and self.bolt / 2 < self.bolt_edge,
            f"bolt holes inside the foot, got a diameter of {self.bolt} at {self.bolt_edge} from the edge",
            "choose a smaller bolt or a larger bolt_edge",
        )
        rows = self.bolt_x[1] - self.bolt_x[0]
        require(
            self,
            rows > self.bolt,
            f"two rows of bolts in the foot, got axes {rows:g} apart",
            "lengthen the foot or choose a smaller bolt or bolt_edge",
        )
        require(
            self,
            self.bolt_x[0] - self.bolt / 2 > t + self.fillet,
            f"bolt holes clear of the fillet, got one {self.bolt_x[0] - self.bolt / 2 - t:g} from the upright",
            f"choose fillet < {self.bolt_x[0] - self.bolt / 2 - t:g} or a larger bolt_edge",
        )
        gap = self.width / 2 - self.bolt_edge - self.bolt / 2 - self.rib_thickness / 2
        require(
            self,
            gap > 0,
            f"bolt holes clear of the rib, got an overlap of {-gap:g}",
            "widen the bracket or choose a thinner rib or a smaller bolt_edge",
        )
        require(
            self, self.bore < self.width, f"bore < width, got {self.bore} and {self.width}", "choose a smaller bore"
        )
        require(
            self,
            self.bore_height + r < self.height,
            f"the bore below the upright's top, got its edge at {self.bore_height + r:g} of {self.height}",
            "lower the bore",
        )
        require(
            self,
            self.bore_height - r > t + max(self.rib_height, self.fillet),
            f"the bore above the rib and the fillet, got its edge at {self.bore_height - r:g} and their top at "
            f"{t + max(self.rib_height, self.fillet):g}",
            "raise the bore or choose a lower rib",
        )
        require(
            self,
            self.rib_length < self.foot_length - t and self.rib_height < self.height - t,
            "a rib that ends on the foot and on the upright",
            "choose a smaller rib",
        )
        slope = np.hypot(self.rib_length, self.rib_height)
        reach = self.rib_length * self.rib_height / (self.rib_length + self.rib_height + slope)
        require(
            self,
            self.fillet < 2 * reach,
            f"fillet < {2 * reach:g} (covered by the rib), got {self.fillet}",
            "choose a smaller fillet or a larger rib",
        )

    @property
    def bolt_x(self) -> tuple[float, float]:
        """Positions x of the two rows of bolts."""
        return self.thickness + self.bolt_edge, self.foot_length - self.bolt_edge

    @property
    def bolt_axes(self) -> tuple[tuple[float, float], ...]:
        """Positions (x, y) of bolts 1 to 4: inner row first, -y before +y."""
        y = self.width / 2 - self.bolt_edge
        return tuple((x, side * y) for x in self.bolt_x for side in (-1, 1))


def mesh_bracket(bracket: Bracket | None = None, *, size: float = 8.0, order: int = 2, path: str | Path) -> PartMesh:
    """Mesh a bracket, and write a binary file in Gmsh 4.1 format.

    Groups: volume "bracket"; faces "bolts" (all four holes), "bolt_1" to "bolt_4" (`Bracket.bolt_axes`), "bore".

    Parameters
    ----------
    bracket
        Dimensions; None: the defaults.
    size
        Largest element size [length unit of the bracket].
    order
        1 (tet4) or 2 (tet10, mid-side nodes on the curved faces).
    path
        File to write; ends in .msh.

    Raises
    ------
    MeshingError
        If gmsh is missing.
    MeshError
        If the mesh has inverted elements or is not one solid.
    """
    bracket = Bracket() if bracket is None else bracket
    with part_model("bracket", size, order) as gmsh:
        draw(gmsh, bracket)
        gmsh.model.occ.synchronize()
        r, t = bracket.bolt / 2, bracket.thickness
        bolts = [
            cylinder_faces(gmsh, np.array([x - r, y - r, 0.0]), np.array([x + r, y + r, t]))
            for x, y in bracket.bolt_axes
        ]
        r, z = bracket.bore / 2, bracket.bore_height
        bore = cylinder_faces(gmsh, np.array([0.0, -r, z - r]), np.array([t, r, z + r]))
        groups = {"bolts": [face for faces in bolts for face in faces], "bore": bore}
        groups |= {f"bolt_{k}": faces for k, faces in enumerate(bolts, start=1)}
        return mesh_and_write(gmsh, name="bracket", groups=groups, path=Path(path))


def draw(gmsh: ModuleType, bracket: Bracket) -> None:
    """Draw the solid: (1) an L-shape with fillet, (2) the rib on it, (3) holes and bore cut out."""
    occ = gmsh.model.occ
    t, f, w = bracket.thickness, bracket.fillet, bracket.width

    def point(x: float, z: float, y: float) -> int:
        return int(occ.addPoint(x, y, z))

    y = -w / 2
    foot, top = bracket.foot_length, bracket.height
    p = [point(x, z, y) for x, z in ((0, 0), (foot, 0), (foot, t), (t + f, t), (t, t + f), (t, top), (0, top))]
    lines = [occ.addLine(p[k], p[k + 1]) for k in (0, 1, 2)]
    arc = occ.addCircleArc(p[3], point(t + f, t + f, y), p[4])
    lines += [arc, occ.addLine(p[4], p[5]), occ.addLine(p[5], p[6]), occ.addLine(p[6], p[0])]
    ell = extrude_y(occ, lines, w)  # (1)
    y = -bracket.rib_thickness / 2
    inside = t / 2  # the rib starts inside both plates, so that solids overlap
    corners = (
        (inside, inside),
        (t + bracket.rib_length, inside),
        (t + bracket.rib_length, t),
        (t, t + bracket.rib_height),
        (inside, t + bracket.rib_height),
    )
    p = [point(x, z, y) for x, z in corners]
    lines = [occ.addLine(p[k], p[(k + 1) % 5]) for k in range(5)]
    whole, _ = occ.fuse([ell], [extrude_y(occ, lines, bracket.rib_thickness)])  # (2)
    tools = [(3, occ.addCylinder(x, y, -t, 0, 0, 3 * t, bracket.bolt / 2)) for x, y in bracket.bolt_axes]
    tools += [(3, occ.addCylinder(-t, 0, bracket.bore_height, 3 * t, 0, 0, bracket.bore / 2))]
    whole, _ = occ.cut(whole, tools)  # (3)
    if len(whole) != 1:
        raise PartError(f"Bracket: expected one solid, got {len(whole)}; the parameters do not fit together")


def extrude_y(occ: ModuleType, lines: list[int], depth: float) -> tuple[int, int]:
    """Return the solid swept along +y by a closed loop of curves in a plane y = const."""
    bodies = occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop(lines)]))], 0, depth, 0)
    return next((dim, tag) for dim, tag in bodies if dim == 3)
