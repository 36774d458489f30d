"""Parametric connecting rod: two bored ends, a tapered I-shaped shank with fillets, and bolt bosses."""

from dataclasses import dataclass
from importlib.resources import files
from math import atan2, cos, hypot, sin, sqrt
from pathlib import Path
from types import ModuleType

import numpy as np

from fe_models.parts.errors import PartError
from fe_models.parts.gmsh_session import PartMesh, cylinder_faces, mesh_and_write, part_model
from fe_models.parts.lengths import require, require_lengths

__all__ = ["SHIPPED_MESHES", "SLENDER_ROD", "ConnectingRod", "mesh_connecting_rod", "shipped_mesh"]


# meshes that are part of the package ----------------------------------------------------------------------------------


#: file of each mesh, in mm: `ConnectingRod` with default dimensions, and `SLENDER_ROD` in elements of 7 mm
SHIPPED_MESHES = {"connecting_rod": "connecting_rod.msh", "slender_rod": "slender_rod.msh"}


def shipped_mesh(name: str) -> Path:
    """Return the path of a mesh of the package, such as "connecting_rod" (tet10, mm, with groups).

    Raises
    ------
    PartError
        If there is no such mesh, or the package was installed without unpacked files.
    """
    if name not in SHIPPED_MESHES:
        raise PartError(f"shipped_mesh: no mesh {name!r}; choices: {', '.join(SHIPPED_MESHES)}")
    resource = files("fe_models.parts") / "data" / SHIPPED_MESHES[name]
    path = Path(str(resource))
    if not path.is_file():
        raise PartError(f"shipped_mesh: {path} is missing; install the package unpacked, with pip")
    return path


# connecting rod -------------------------------------------------------------------------------------------------------


Point = tuple[float, float]

ROOT_ANGLE = np.deg2rad(30.0)  #: angle between fillet and ring; at 0 the face of the shank would end in a cusp


@dataclass(frozen=True)
class ConnectingRod:
    """Dimensions of a connecting rod, in any one length unit (defaults: a passenger car's rod in mm).

    The centre of the big end is the origin, the small end is on +x, and the bores are along z. The rod is symmetric
    about y = 0 and z = 0.
    """

    centre_distance: float = 140.0  #: distance between the bore axes
    big_bore: float = 48.0  #: bore diameter of the big end
    big_outer: float = 68.0  #: outer diameter of the big end
    big_width: float = 24.0  #: width of the big end along z
    small_bore: float = 22.0  #: bore diameter of the small end
    small_outer: float = 34.0  #: outer diameter of the small end
    small_width: float = 24.0  #: width of the small end along z
    shank_height_big: float = 32.0  #: height of the shank along y, with its taper extended to the axis of the big end
    #: height of the shank along y, with its taper extended to the axis of the small end
    shank_height_small: float = 22.0
    shank_width: float = 16.0  #: width of the shank along z
    web: float = 5.0  #: thickness of the web between the two pockets along z; equal to shank_width: no pockets
    flange: float = 4.5  #: thickness of the flanges beside the pockets, in the xy plane
    fillet: float = 14.0  #: radius of the fillet between shank and ends, in the xy plane
    bolt: float = 8.0  #: diameter of the bolt holes of the cap; 0: no holes and no bosses
    boss: float = 18.0  #: diameter of the bolt bosses
    boss_length: float = 46.0  #: length of the bolt bosses along x

    def __post_init__(self) -> None:
        require_lengths(self, zero_allowed=("bolt",))
        for end in ("big", "small"):
            bore, outer = getattr(self, f"{end}_bore"), getattr(self, f"{end}_outer")
            require(self, bore < outer, f"{end}_bore < {end}_outer, got {bore} and {outer}", "thicken the ring")
            height, width = getattr(self, f"shank_height_{end}"), getattr(self, f"{end}_width")
            require(
                self,
                height < outer,
                f"shank_height_{end} < {end}_outer, got {height} and {outer}",
                "the shank must run into the ring",
            )
            require(
                self,
                self.shank_width <= width,
                f"shank_width <= {end}_width, got {self.shank_width} and {width}",
                "make the shank thinner",
            )
        rings = (self.big_outer + self.small_outer) / 2
        require(
            self,
            self.centre_distance > rings,
            f"centre_distance > {rings:g} (both outer radii), got {self.centre_distance}",
            "lengthen the rod",
        )
        require(
            self,
            self.web <= self.shank_width,
            f"web <= shank_width, got {self.web} and {self.shank_width}",
            "make the web thinner",
        )
        outline = shank_outline(self)
        require(
            self,
            outline[1][0] < outline[2][0],
            f"fillets that leave some straight shank, got a radius of {self.fillet}",
            "choose a smaller fillet or a longer rod",
        )
        if self.web < self.shank_width:
            pocket = pocket_circles(self)
            require(
                self,
                pocket is not None,
                f"room for the pockets inside flanges of {self.flange}",
                "choose thinner flanges, a higher or longer shank, or web = shank_width",
            )
        if self.bolt:
            require(self, self.bolt < self.boss, f"bolt < boss, got {self.bolt} and {self.boss}", "widen the boss")
            require(
                self,
                self.boss <= self.big_width,
                f"boss <= big_width, got {self.boss} and {self.big_width}",
                "choose a smaller boss",
            )
            require(
                self,
                self.boss_length < self.big_outer,
                f"boss_length < big_outer, got {self.boss_length} and {self.big_outer}",
                "shorten the boss",
            )

    @property
    def bolt_offset(self) -> float:
        """Distance along y between a bolt axis and the rod axis, at which the boss just touches the bore."""
        return (self.big_bore + self.boss) / 2


def shank_outline(rod: ConnectingRod) -> tuple[Point, Point, Point, Point, Point, Point]:
    """Return tangent points of the upper outline and centres of its two fillets, in the xy plane.

    The upper edge of the shank is the line n·p = d, n = (sin a, cos a). A fillet of radius f touches it from above, so
    its centre c has n·c = d + f. It crosses the outer circle (centre o, radius R) at `ROOT_ANGLE`, so that |c - o|² =
    R² + f² + 2 R f cos(ROOT_ANGLE) by the law of cosines. It touches the circle of radius |c - o| - f inside the ring.

    Returns
    -------
    tuple
        The point inside the big ring, the points on the line at the big and the small end, the point inside the small
        ring, and the centres of the fillets at the big and the small end.
    """
    a, d = taper(rod)
    found = []
    for x_o, R, side in ((0.0, rod.big_outer / 2, 1.0), (rod.centre_distance, rod.small_outer / 2, -1.0)):
        f = rod.fillet
        across = d + f - sin(a) * x_o
        reach = sqrt(R**2 + f**2 + 2 * R * f * cos(ROOT_ANGLE))
        along = side * sqrt(max(reach**2 - across**2, 0.0))
        c = (x_o + sin(a) * across + cos(a) * along, cos(a) * across - sin(a) * along)
        on_line = (c[0] - f * sin(a), c[1] - f * cos(a))
        on_ring = (x_o + (c[0] - x_o) * (reach - f) / reach, c[1] * (reach - f) / reach)
        found.append((on_ring, on_line, c))
    (ring_big, line_big, c_big), (ring_small, line_small, c_small) = found
    return ring_big, line_big, line_small, ring_small, c_big, c_small


def taper(rod: ConnectingRod) -> tuple[float, float]:
    """Return the angle a of the upper edge of the shank [rad], and its distance d from the origin [length]."""
    a = atan2((rod.shank_height_big - rod.shank_height_small) / 2, rod.centre_distance)
    return a, rod.shank_height_big / 2 * cos(a)


def pocket_circles(rod: ConnectingRod) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return (x, radius) of the two end circles of a pocket, one flange away from outline and rings; or None."""
    a, d = taper(rod)
    inside = d - rod.flange
    x_big = (rod.big_outer / 2 + rod.flange + inside) / (1 + sin(a))
    x_small = (rod.centre_distance - rod.small_outer / 2 - rod.flange - inside) / (1 - sin(a))
    r_big, r_small = inside - x_big * sin(a), inside - x_small * sin(a)
    return ((x_big, r_big), (x_small, r_small)) if x_small > x_big and r_small > 0 and r_big > 0 else None


def mesh_connecting_rod(
    rod: ConnectingRod | None = None, *, size: float = 5.5, order: int = 2, path: str | Path
) -> PartMesh:
    """Mesh a connecting rod, and write a binary file in Gmsh 4.1 format.

    Groups: volume "rod"; faces "big_end" and "small_end" (the bores).

    Parameters
    ----------
    rod
        Dimensions; None: the defaults.
    size
        Largest element size [length unit of the rod].
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
    rod = ConnectingRod() if rod is None else rod
    with part_model("rod", size, order) as gmsh:
        draw(gmsh, rod)
        gmsh.model.occ.synchronize()
        groups = {}
        for end, x in (("big", 0.0), ("small", rod.centre_distance)):
            r, h = getattr(rod, f"{end}_bore") / 2, getattr(rod, f"{end}_width") / 2
            groups[f"{end}_end"] = cylinder_faces(gmsh, np.array([x - r, -r, -h]), np.array([x + r, r, h]))
        return mesh_and_write(gmsh, name="rod", groups=groups, path=Path(path))


def draw(gmsh: ModuleType, rod: ConnectingRod) -> None:
    """Draw the solid: (1) a plate with the outline, (2) rings and bosses, (3) bores, holes and pockets cut out."""
    occ = gmsh.model.occ
    L, z = rod.centre_distance, rod.shank_width / 2
    plate = extrude(occ, outline_wire(occ, rod, -z), rod.shank_width)  # (1)
    solids = [
        (3, occ.addCylinder(0, 0, -rod.big_width / 2, 0, 0, rod.big_width, rod.big_outer / 2)),
        (3, occ.addCylinder(L, 0, -rod.small_width / 2, 0, 0, rod.small_width, rod.small_outer / 2)),
    ]
    tools = [
        (3, occ.addCylinder(0, 0, -rod.big_width, 0, 0, 2 * rod.big_width, rod.big_bore / 2)),
        (3, occ.addCylinder(L, 0, -rod.small_width, 0, 0, 2 * rod.small_width, rod.small_bore / 2)),
    ]
    if rod.bolt:
        for side in (1, -1):
            y, x = side * rod.bolt_offset, -rod.boss_length / 2
            solids += [boss(occ, rod, side)]
            tools += [(3, occ.addCylinder(2 * x, y, 0, 2 * rod.boss_length, 0, 0, rod.bolt / 2))]
    pocket = pocket_circles(rod)
    if rod.web < rod.shank_width and pocket is not None:
        depth = (rod.shank_width - rod.web) / 2
        tools += [extrude(occ, slot_wire(occ, pocket, rod.web / 2), 2 * depth)]
        tools += [extrude(occ, slot_wire(occ, pocket, -rod.web / 2), -2 * depth)]
    whole, _ = occ.fuse([plate], solids)  # (2)
    whole, _ = occ.cut(whole, tools)  # (3)
    if len(whole) != 1:
        raise PartError(f"ConnectingRod: expected one solid, got {len(whole)}; the parameters do not fit together")


def outline_wire(occ: ModuleType, rod: ConnectingRod, z: float) -> int:
    """Return the closed outline of the plate in the plane z: bore centre, fillet, edge, fillet, bore centre, mirrored.

    Inside the rings the plate ends in wedges. An outline along the outer circles would leave seams on the rings.
    """
    ring_big, line_big, line_small, ring_small, c_big, c_small = shank_outline(rod)

    def point(p: Point, side: int = 1) -> int:
        return int(occ.addPoint(p[0], side * p[1], z))

    back, front = point((0.0, 0.0)), point((rod.centre_distance, 0.0))
    halves = []
    for side in (1, -1):
        p = [point(q, side) for q in (ring_big, line_big, line_small, ring_small)]
        centre_big, centre_small = point(c_big, side), point(c_small, side)
        halves.append(
            [
                occ.addLine(back, p[0]),
                occ.addCircleArc(p[0], centre_big, p[1]),
                occ.addLine(p[1], p[2]),
                occ.addCircleArc(p[2], centre_small, p[3]),
                occ.addLine(p[3], front),
            ]
        )
    return int(occ.addCurveLoop([*halves[0], *reversed(halves[1])]))


def slot_wire(occ: ModuleType, circles: tuple[tuple[float, float], tuple[float, float]], z: float) -> int:
    """Return the convex hull of two circles (x, radius) on the x axis, in the plane z."""
    (x_1, r_1), (x_2, r_2) = circles
    n_x = (r_1 - r_2) / hypot(x_2 - x_1, 0.0)
    n = (n_x, sqrt(1 - n_x**2))  # unit normal of the upper common tangent
    up_1, up_2 = occ.addPoint(x_1 + r_1 * n[0], r_1 * n[1], z), occ.addPoint(x_2 + r_2 * n[0], r_2 * n[1], z)
    low_1, low_2 = occ.addPoint(x_1 + r_1 * n[0], -r_1 * n[1], z), occ.addPoint(x_2 + r_2 * n[0], -r_2 * n[1], z)
    back, front = occ.addPoint(x_1 - r_1, 0, z), occ.addPoint(x_2 + r_2, 0, z)
    c_1, c_2 = occ.addPoint(x_1, 0, z), occ.addPoint(x_2, 0, z)
    return int(
        occ.addCurveLoop(
            [
                occ.addCircleArc(back, c_1, up_1),
                occ.addLine(up_1, up_2),
                occ.addCircleArc(up_2, c_2, front),
                occ.addCircleArc(front, c_2, low_2),
                occ.addLine(low_2, low_1),
                occ.addCircleArc(low_1, c_1, back),
            ]
        )
    )


def boss(occ: ModuleType, rod: ConnectingRod, side: int) -> tuple[int, int]:
    """Return a bolt boss along x at y = side * bolt_offset, which is round outside and open toward the ring."""
    x, y, r = -rod.boss_length / 2, side * rod.bolt_offset, rod.boss / 2
    corners = [occ.addPoint(x, yy, zz) for yy, zz in ((0, -r), (y, -r), (y + side * r, 0), (y, r), (0, r))]
    centre = occ.addPoint(x, y, 0)
    wire = occ.addCurveLoop(
        [
            occ.addLine(corners[0], corners[1]),
            occ.addCircleArc(corners[1], centre, corners[2]),
            occ.addCircleArc(corners[2], centre, corners[3]),
            occ.addLine(corners[3], corners[4]),
            occ.addLine(corners[4], corners[0]),
        ]
    )
    bodies = occ.extrude([(2, occ.addPlaneSurface([wire]))], rod.boss_length, 0, 0)
    return next((dim, tag) for dim, tag in bodies if dim == 3)


def extrude(occ: ModuleType, wire: int, height: float) -> tuple[int, int]:
    """Return the solid swept along z by the plane face of a wire."""
    bodies = occ.extrude([(2, occ.addPlaneSurface([wire]))], 0, 0, height)
    return next((dim, tag) for dim, tag in bodies if dim == 3)


SLENDER_ROD = ConnectingRod(
    centre_distance=300.0,
    big_bore=18.0,
    big_outer=32.0,
    big_width=10.0,
    small_bore=12.0,
    small_outer=24.0,
    small_width=10.0,
    shank_height_big=3.5,
    shank_height_small=3.5,
    shank_width=10.0,
    web=10.0,
    flange=1.0,
    fillet=8.0,
    bolt=0.0,
)  #: rod cut from a plate of 10 mm, so slender that its inertia visibly bends it at 2400 revolutions per minute
