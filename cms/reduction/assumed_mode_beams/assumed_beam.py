"""A reduced body of a straight beam without a mesh, from assumed functions along its axis."""

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from cms.body.geometric_stiffness import GeometricStiffness
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.body.source_columns import source_columns
from cms.errors import BodyError, ModeSetError
from cms.linear_algebra.independent import RANK_TOLERANCE
from cms.linear_algebra.solvers.eigen import orientation
from cms.modes.mode_sets.axis_functions import AXIS_FUNCTIONS, CUBIC
from cms.reduction.assumed_mode_beams.beam_fields import (
    BeamFields,
    beam_fields,
    beam_moments,
    inertia_rows,
    rigid_fields,
    strain_rows,
)
from cms.reduction.basis.damping import Damping, modal_damping
from cms.reduction.basis.frames import (
    BuckensFrame,
    Frame,
    NodalFrame,
    TisserandFrame,
    checked_dofs,
    determinate_rows,
    placed,
)
from cms.reduction.geometric_stiffness.unit_states import unit_mass_loads
from fe_models.body.beam_line import BeamLine
from fe_models.body.rigid_motion import MassLoads, rotation_work
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.numbering import Numbering

__all__ = ["beam_from_assumed_modes", "beam_geometric_stiffness", "tube"]


# a skin for beams without a mesh: an elliptic tube with the radii of gyration of the sections -------------------------


N_RINGS, N_CORNERS = 21, 8
THINNEST = 5e-3  #: radius of the skin divided by the beam length, used if the beam has no rotary inertia


def tube(line: BeamLine) -> tuple[Array, Array, IntArray]:
    """Return positions x, offsets (y, z) and triangles of an elliptic tube with the sections' radii of gyration."""
    x = np.linspace(0.0, line.length, N_RINGS)
    mass = line.at("rho_A", x)
    # semi-axes of an ellipse: 2 sqrt(I/A)
    y, z = (2 * np.sqrt(line.at(name, x) / mass) for name in ("rho_Iz", "rho_Iy"))
    angle = 2 * np.pi * np.arange(N_CORNERS) / N_CORNERS
    least = THINNEST * line.length
    ring = np.stack([np.maximum(y, least)[:, None] * np.cos(angle), np.maximum(z, least)[:, None] * np.sin(angle)], 2)
    corner = np.arange(N_CORNERS)
    after = (corner + 1) % N_CORNERS
    strip = np.concatenate([
        np.stack([corner, after, corner + N_CORNERS], 1), np.stack([after, after + N_CORNERS, corner + N_CORNERS], 1)
    ])  # fmt: skip
    cap = np.stack([np.zeros(N_CORNERS - 2, np.int64), corner[1:-1], corner[2:]], 1)
    last = N_CORNERS * (N_RINGS - 1)
    triangles = np.concatenate([*(strip + N_CORNERS * k for k in range(N_RINGS - 1)), cap[:, ::-1], cap + last])
    return np.repeat(x, N_CORNERS), ring.reshape(-1, 2), triangles


# assumed beam ---------------------------------------------------------------------------------------------------------


def beam_from_assumed_modes(
    line: BeamLine,
    *,
    name: str,
    units: Units,
    n_axial: int = 2,
    n_bending: int = 4,
    n_torsion: int = 1,
    n_shear: int | None = None,
    functions: str = "legendre",
    stations: Mapping[str, float] | None = None,
    frame: Frame | None = None,
    damping: Damping | None = None,
    geometric: bool = True,
) -> ReducedBody:
    """Return a beam whose displacement is a sum of functions along its axis (Ritz), reduced and ready for a system.

    Energies and inertia integrals of all orders are integrals of polynomials along x, which Gauss points integrate
    exactly.

    (1) make the columns: axial, torsion, bending and shear along y and z (`beam_fields`), minus the rigid motion that
        the frame removes
    (2) write W = K + omega_1² M as A_Wᵀ A_W, where the rows of A_W are strain and motion at the Gauss points; pivoted
        QR of A_W, which does not square the condition number, gives independent columns
    (3) solve K z = omega² M z over them; the shapes are M-orthonormal and K-diagonal

    Parameters
    ----------
    line
        Mass and stiffness along x. The mesh axes of the body are the beam axes, with the origin at the start of the
        beam.
    name, units
        Name and unit system of the body.
    n_axial, n_bending, n_torsion
        Number of functions for each motion; n_bending counts for y and z separately.
    n_shear
        Number of functions for the shear rotation, for y and z separately; default: n_bending + 1, or none if shear is
        rigid.
    functions
        "legendre", "monomials" or "splines".
    stations
        Position x of each interface, by name; default: "start" and "end".
    frame
        Default: Tisserand (mean axes, for a free beam). `NodalFrame("start")` gives functions clamped there;
        `NodalFrame(dofs=...)` fixes six (station, component) pairs.
    damping
        Damping; default: none.
    geometric
        Whether to compute the geometric stiffness of the unit loads, with which loads stiffen the body in a system.

    Returns
    -------
    ReducedBody
        It has n_axial + n_torsion + 2 (n_bending + n_shear) modes, minus redundant ones (named in `provenance`). Its
        skin for drawing is an elliptic tube with the radii of gyration of the section.

    Raises
    ------
    ModeSetError
        If a number is negative, no function is requested, or the family is unknown.
    BodyError
        If a mass or stiffness law is not positive, a station is not on the beam, or the frame cannot be attached.
    """
    where = f"beam_from_assumed_modes: {name!r}"
    if functions not in AXIS_FUNCTIONS:
        raise ModeSetError(f"{where}: unknown functions {quoted(functions)}{nearest(functions, AXIS_FUNCTIONS)}")
    if n_shear is None:
        n_shear = n_bending + 1 if line.has_shear and n_bending > 0 else 0
    counts = {"axial": n_axial, "bending": n_bending, "torsion": n_torsion, "shear": n_shear}
    for motion, count in counts.items():
        if count < 0:
            raise ModeSetError(f"{where}: n_{motion} = {count}; expected 0 or more")
    if not any(counts.values()):
        raise ModeSetError(f"{where}: expected at least one function, got none")
    if n_shear and not line.has_shear:
        raise ModeSetError(f"{where}: n_shear = {n_shear}, but the beam is rigid in shear; give GAy and GAz")
    places = {"start": 0.0, "end": line.length} if stations is None else dict(stations)
    x_station = station_places(where, line, places)

    x, weight = gauss_points(line, functions, counts)
    require_rotary_inertia(where, line, x, counts)
    fields = beam_fields(functions, counts, line, x)
    rigid = rigid_fields(x, np.zeros(3))
    condition = frame_of_beam(where, line, frame or TisserandFrame(), x_station, list(places), (x, weight, rigid))
    at_stations = beam_fields(functions, counts, line, x_station).motion
    C = rigid_part(condition, inertia_rows(line, x, weight, rigid), inertia_rows(line, x, weight, fields.motion),
                   (x_station, at_stations))  # fmt: skip

    A_K = strain_rows(line, x, weight, fields.strain)
    A_M = inertia_rows(line, x, weight, fields.motion - rigid @ C)
    T, omega2, dropped = elastic_modes(fields, A_K, A_M)  # steps (2), (3)
    x_skin, skin, triangles = tube(line)
    nodes_x = np.concatenate([x_station, x_skin])

    def shapes(at: Array) -> Array:
        """Return the motion of the sections in each mode, (n, 6, n_q)."""
        motion = beam_fields(functions, counts, line, at).motion
        return np.asarray((motion - rigid_fields(at, np.zeros(3)) @ C) @ T)

    U = shapes(nodes_x)
    turn = orientation(U.reshape(-1, T.shape[1]), omega2)
    T, U = T @ turn, U @ turn
    offsets = np.concatenate([np.zeros((len(x_station), 2)), skin])
    nodes = np.column_stack([nodes_x, offsets])
    arm = np.column_stack([np.zeros(len(nodes)), offsets])
    # u + theta × o
    Phi = U[:, :3] + np.cross(U[:, 3:], arm[:, :, None], axisa=1, axisb=1, axisc=1)

    axes, origin = condition.axes, condition.origin
    columns = source_columns(fields.labels, fields.groups, T, A_K.T @ (A_K @ T))
    interfaces = tuple(
        ReducedInterface(
            station,
            "rigid",
            position=axes.T @ (nodes[k] - origin),
            triad=axes.T,
            Psi=np.concatenate([axes.T @ U[k, :3], axes.T @ U[k, 3:]]),
            members=np.array([k]),
        )
        for k, station in enumerate(places)
    )
    M, K = np.eye(len(omega2)), np.diag(omega2)
    return ReducedBody(
        name=name,
        units=units,
        frame=condition,
        M=M,
        K=K,
        D=np.zeros_like(K) if damping is None else modal_damping(damping, M, K, second=units.time),
        labels=columns.mode_labels(),
        energy_shares=columns.group_shares(),
        sources=columns.sources,
        moments=beam_moments(line, (x, weight), shapes(x), condition),
        free_frequencies=free_frequencies(line, (x, weight, rigid), fields, A_K),
        nodes=(nodes - origin) @ axes,
        node_ids=np.arange(len(nodes)),
        Phi=np.einsum("ba,nbk->nak", axes, Phi),
        surface=triangles + len(x_station),
        interfaces=interfaces,
        provenance=provenance(line, functions, counts, dropped),
        columns=columns,
        geometric=stiffening(line, functions, counts, C, T, x_station, condition) if geometric else None,
    )


def require_rotary_inertia(where: str, line: BeamLine, x: Array, counts: Mapping[str, int]) -> None:
    """Raise `BodyError` if torsion or shear would move without mass, which gives infinite eigenvalues."""
    has_y, has_z = line.at("rho_Iy", x).any(), line.at("rho_Iz", x).any()
    if counts["torsion"] and not (has_y or has_z):
        raise BodyError(
            f"{where}: n_torsion = {counts['torsion']}, but the sections have no moment of inertia about x, so that "
            "torsion has no mass; give rho_Iy and rho_Iz, or n_torsion = 0 in a nodal frame"
        )
    if counts["shear"] and not (has_y and has_z):
        raise BodyError(
            f"{where}: n_shear = {counts['shear']}, but the sections have no rotary inertia, so that shear has no "
            "mass; give rho_Iy and rho_Iz, or leave GAy and GAz infinite"
        )


def stiffening(
    line: BeamLine, functions: str, counts: Mapping[str, int], C: Array, T: Array, x_station: Array, frame: BodyFrame
) -> GeometricStiffness:
    """Return the geometric stiffness of the modes T; section forces are discontinuous at the stations."""
    x, weight = gauss_points(line, functions, counts, breaks=x_station, more=CUBIC + 1)
    fields = beam_fields(functions, counts, line, x)
    motion = (fields.motion - rigid_fields(x, np.zeros(3)) @ C) @ T
    return beam_geometric_stiffness(line, (x, weight), motion, fields.strain @ T, x_station, frame)


def station_places(where: str, line: BeamLine, places: Mapping[str, float]) -> Array:
    """Return the checked positions of the stations, (n_stations,)."""
    x = np.array([float(value) for value in places.values()])
    outside = [name for name, value in places.items() if not 0 <= float(value) <= line.length]
    if outside:
        raise BodyError(
            f"{where}: station {outside[0]!r}: expected a position in 0 .. {line.length:g}, got {places[outside[0]]:g}"
        )
    if not len(x):
        raise BodyError(f"{where}: expected at least one station, where joints and forces act; got none")
    return x


def gauss_points(
    line: BeamLine, functions: str, counts: Mapping[str, int], *, breaks: Array | None = None, more: int = 0
) -> tuple[Array, Array]:
    """Return points and weights that integrate products of two functions and a polynomial of degree `more` exactly."""
    inner = np.zeros(0) if breaks is None else breaks
    if functions != "splines":
        return line.points(2 * max(counts[name] + (name == "bending") for name in counts) + more, breaks=inner)
    sets = [count + first for count, first in zip(counts.values(), (1, 2, 1, 0), strict=True) if count]
    knots = [np.linspace(0.0, line.length, n - CUBIC + 1) for n in sets if n > CUBIC]
    return line.points(2 * CUBIC + more, breaks=np.concatenate([*knots, inner]))


def frame_of_beam(
    where: str, line: BeamLine, frame: Frame, x_station: Array, names: list[str], integral: tuple[Array, Array, Array]
) -> BodyFrame:
    """Return the body frame. Its origin is the centre of mass, or the station to which a nodal frame is attached."""
    x, weight, rigid = integral
    mass = weight * line.at("rho_A", x)
    center = np.array([mass @ x / mass.sum(), 0.0, 0.0])
    if isinstance(frame, BuckensFrame):
        raise BodyError(f"{where}: a beam without a mesh has no Buckens frame; take a Tisserand or a nodal frame")
    if isinstance(frame, TisserandFrame):
        rows = inertia_rows(line, x, weight, rigid)
        size = np.linalg.norm(rows, axis=0)
        if (size[3:] <= 1e-12 * size[0] * line.length).any():
            raise BodyError(
                f"{where}: no moment of inertia about x; a Tisserand frame needs one: give rho_Iy, rho_Iz or take a "
                "nodal frame"
            )
        return placed("tisserand", frame, center)
    if frame.at is not None and frame.at not in names:
        raise BodyError(f"{where}: nodal frame: no station {quoted(frame.at)}{nearest(frame.at, names)}")
    held = held_dofs(where, frame, x_station, names)
    default = center if frame.at is None else np.array([x_station[names.index(frame.at)], 0.0, 0.0])
    return placed("nodal", frame, default, held)


def held_dofs(where: str, frame: NodalFrame, x_station: Array, names: list[str]) -> IntArray:
    """Return the six (station, component) pairs that a nodal frame fixes, (6, 2)."""
    points = np.column_stack([x_station, np.zeros((len(x_station), 2))])
    if frame.dofs is not None:
        held = checked_dofs(frame, f"{where}: nodal frame", Numbering())
        if held[:, 0].min() < 0 or held[:, 0].max() >= len(names):
            raise BodyError(f"{where}: nodal frame: dofs: expected stations 0..{len(names) - 1}, got {frame.dofs}")
        determinate_rows(points[held[:, 0]], held[:, 1], f"{where}: nodal frame")
        return held
    stations = range(len(names)) if frame.at is None else [names.index(frame.at)]
    every = np.array([(k, component) for k in stations for component in range(6)], dtype=np.int64)
    return every[determinate_rows(points[every[:, 0]], every[:, 1], f"{where}: nodal frame")]


def rigid_part(frame: BodyFrame, rigid_rows: Array, rows: Array, at_stations: tuple[Array, Array]) -> Array:
    """Return C, (6, n_columns): the rigid motion about x = 0 that the frame condition removes from each column."""
    if frame.kind == "tisserand":
        return np.asarray(np.linalg.lstsq(rigid_rows, rows, rcond=None)[0])
    x_station, motion = at_stations
    station, component = frame.dofs.T
    return np.asarray(
        np.linalg.solve(rigid_fields(x_station, np.zeros(3))[station, component], motion[station, component])
    )


def elastic_modes(fields: BeamFields, A_K: Array, A_M: Array) -> tuple[Array, Array, tuple[str, ...]]:
    """Steps (2), (3): return the modes in terms of the columns, (n_columns, n_q), omega², and redundant labels."""
    mass, stiffness = (np.einsum("nk,nk->k", A, A) for A in (A_M, A_K))
    omega2_1 = float((stiffness / mass).min())
    A_W = np.vstack([A_K / np.sqrt(omega2_1), A_M])
    size = np.linalg.norm(A_W, axis=0)
    _, R, pivots = la.qr(A_W / size, mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(R)) > RANK_TOLERANCE).sum())
    kept = pivots[:rank]
    basis = np.zeros((len(size), rank))
    basis[kept] = la.solve_triangular(R[:rank, :rank], np.eye(rank)) / size[kept, None]
    B_K, B_M = A_K @ basis, A_M @ basis
    _, Z = la.eigh(B_K.T @ B_K, B_M.T @ B_M)
    T = basis @ Z
    omega2 = np.einsum("nk,nk->k", A_K @ T, A_K @ T)
    order = np.argsort(omega2)
    return T[:, order], omega2[order], tuple(fields.labels[k] for k in pivots[rank:])


def free_frequencies(line: BeamLine, integral: tuple[Array, Array, Array], fields: BeamFields, A_K: Array) -> Array:
    """Return the frequencies of the unsupported beam, ascending [Hz]; empty if its inertia about x is zero."""
    x, weight, rigid = integral
    rows = inertia_rows(line, x, weight, rigid)
    if not np.linalg.norm(rows[:, 3]) > 0:
        return np.zeros(0)
    A_M = inertia_rows(line, x, weight, fields.motion)
    rest = A_M - rows @ np.linalg.lstsq(rows, A_M, rcond=None)[0]
    _, omega2, _ = elastic_modes(fields, A_K, rest)
    return np.asarray(np.sqrt(omega2) / (2 * np.pi))


def provenance(line: BeamLine, functions: str, counts: Mapping[str, int], dropped: tuple[str, ...]) -> dict[str, str]:
    """Return a record of how the body was made."""
    laws = {name: getattr(line, name) for name in ("rho_A", "EA", "EIy", "EIz", "GJ", "rho_Iy", "rho_Iz", "GAy", "GAz")}
    return {
        "mode set": "assumed-modes of a beam without a mesh",
        "mode set functions": functions,
        **{f"mode set n_{motion}": str(count) for motion, count in counts.items()},
        "mode set redundant": "; ".join(dropped) or "none",
        "length": repr(line.length),
        **{key: "function" if callable(law) else repr(float(law)) for key, law in laws.items()},
        "version python": platform.python_version(),
        "version numpy": metadata.version("numpy"),
    }


# geometric stiffness of a straight beam without a mesh, from section forces in equilibrium (theory.md §7) -------------
# n(x) and m(x) are the force and moment of the part beyond x on the part before it: resultants of the loads per unit
# mass, the loads on stations and the support reaction beyond x. They do work on the second-order strains of a section,
# and n·e_x also on those of its twisted fibres. Loads off the axis do work on the second-order rotation of the section:
#
#     Gamma = u' - theta × e  +  [-theta × u' + ½ theta × (theta × e)],   kappa = theta'  +  [-½ theta × theta']


E_X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class BeamLoads:
    """Loads per unit mass and wrenches at stations; load j has a part of each kind."""

    mass: MassLoads  #: k loads per unit mass
    x_station: Array  #: positions of the stations along the beam, (n_stations,) [m]
    wrench: Array  #: force and moment at each station, (n_stations, 6, k) [N, N m]


def beam_geometric_stiffness(
    line: BeamLine, points: tuple[Array, Array], motion: Array, strain: Array, x_station: Array, frame: BodyFrame
) -> GeometricStiffness:
    """Return the geometric stiffness under each unit load of a frame.

    Parameters
    ----------
    line
        The beam.
    points
        Gauss points and weights with breaks at the stations, (n,) each [m].
    motion, strain
        Motion and strain of the sections for the modes at the points, (n, 6, n_q), see
        `cms.reduction.assumed_mode_beams.beam_fields`.
    x_station
        Positions of the interfaces, (n_stations,) [m].
    frame
        A Tisserand or nodal frame, which is the support of all loads.
    """
    loads = balanced(line, unit_loads(x_station, frame), frame)
    K = work_of_second_order(line, points, motion, strain, loads)
    return GeometricStiffness(
        translation=K[:3],
        rotation=K[3:6],
        spin=K[6:12],
        interfaces=K[12:].reshape(len(x_station), 6, *K.shape[1:]),
    )


def unit_loads(x_station: Array, frame: BodyFrame) -> BeamLoads:
    """Return the 12 loads per unit mass, then six unit wrench components for each station, in axes of B."""
    mass = unit_mass_loads(frame, 6 * len(x_station))
    wrench = np.zeros((len(x_station), 6, mass.k))
    for i in range(len(x_station)):
        wrench[i, :, 12 + 6 * i : 18 + 6 * i] = np.kron(np.eye(2), frame.axes)
    return BeamLoads(mass, x_station, wrench)


def balanced(line: BeamLine, loads: BeamLoads, frame: BodyFrame) -> BeamLoads:
    """Return each load with its support reaction: inertia forces of a rigid motion, or forces on fixed dofs."""
    x, weight = line.points(2)
    rigid = rigid_fields(x, np.zeros(3))
    q, mu, _ = densities(line, x, loads.mass)
    density = np.concatenate([q, mu], axis=1) * weight[:, None, None]
    at_stations = rigid_fields(loads.x_station, np.zeros(3))
    resultant = np.einsum("nci,ncj->ij", rigid, density) + np.einsum("nci,ncj->ij", at_stations, loads.wrench)
    if frame.kind == "tisserand":
        rows = inertia_rows(line, x, weight, rigid)
        amounts = np.linalg.solve(rows.T @ rows, resultant)
        return BeamLoads(loads.mass.plus_rigid(-amounts, np.zeros(3)), loads.x_station, loads.wrench)
    station, component = frame.dofs.T
    reaction = np.linalg.solve(at_stations[station, component].T, -resultant)
    wrench = np.array(loads.wrench)
    np.add.at(wrench, (station, component), reaction)
    return BeamLoads(loads.mass, loads.x_station, wrench)


def densities(line: BeamLine, x: Array, mass: MassLoads) -> tuple[Array, Array, Array]:
    """Return force and couple per length, (n, 3, k), and V = Σ f oᵀ per length, (n, 3, 3, k), at positions x."""
    centers = np.column_stack([x, np.zeros((len(x), 2))])
    q = line.at("rho_A", x)[:, None, None] * mass.at(centers)
    E = np.stack([np.zeros(len(x)), line.at("rho_Iz", x), line.at("rho_Iy", x)], axis=1)
    V = np.einsum("jab,nb->nabj", mass.A, E)
    return q, axial(V), V


def axial(V: Array) -> Array:
    """Return Σ o × f from V = Σ f oᵀ, (n, 3, k)."""
    return np.stack([V[:, 2, 1] - V[:, 1, 2], V[:, 0, 2] - V[:, 2, 0], V[:, 1, 0] - V[:, 0, 1]], axis=1)


def section_forces(line: BeamLine, x: Array, loads: BeamLoads) -> tuple[Array, Array]:
    """Return section force n and moment m at positions x, (n, 3, k) each: the resultants of the loads beyond x."""
    cuts = np.array([0.0, *line.breaks, line.length])
    xi, weight = np.polynomial.legendre.leggauss(line.degree // 2 + 2)
    k = loads.mass.k
    n, m = np.zeros((len(x), 3, k)), np.zeros((len(x), 3, k))
    for start, end in pairwise(cuts):  # integrate from x, or from the start of the piece, to its end
        first = np.clip(x, start, end)
        half = (end - first) / 2
        for at, w in zip(xi, weight, strict=True):
            place = first + half * (1 + at)
            q, mu, _ = densities(line, place, loads.mass)
            amount = (half * w)[:, None, None]
            n += amount * q
            m += amount * (mu + (place - x)[:, None, None] * across(q))
    for place, wrench in zip(loads.x_station, loads.wrench, strict=True):
        beyond = (place > x)[:, None, None]
        n += beyond * wrench[:3]
        m += beyond * (wrench[3:] + (place - x)[:, None, None] * across(wrench[None, :3]))
    return n, m


def across(v: Array) -> Array:
    """Return e_x × v, (n, 3, k)."""
    return np.stack([np.zeros_like(v[:, 0]), -v[:, 2], v[:, 1]], axis=1)


def work_of_second_order(
    line: BeamLine, points: tuple[Array, Array], motion: Array, strain: Array, loads: BeamLoads
) -> Array:
    """Return the second-order work of each load as a matrix over the modes, (k, n_q, n_q)."""
    x, weight = points
    n, m = section_forces(line, x, loads)
    _, _, V = densities(line, x, loads.mass)
    theta, turned = motion[:, 3:], strain[:, 3:]
    # u' = Gamma + theta × e
    slope = strain[:, :3] - across(theta)
    half = np.cross(slope[:, :, None, :], theta[:, :, :, None], axis=1)  # -(theta_k × u_l'), [n, a, k, l]
    K = np.einsum("naj,nakl,n->jkl", n, half, weight, optimize=True)
    half = np.cross(turned[:, :, None, :], theta[:, :, :, None], axis=1)
    K += np.einsum("naj,nakl,n->jkl", m, half, weight / 2, optimize=True)
    K = K + K.transpose(0, 2, 1)
    moments = np.moveaxis(np.einsum("naj,b->nabj", n, E_X) - V, 3, 1)  # [n, j, a, b]
    K += np.einsum("nak,njab,nbl,n->jkl", theta, rotation_work(moments), theta, weight, optimize=True)
    radius2 = (line.at("EIy", x) + line.at("EIz", x)) / line.at("EA", x)
    twist = turned[:, 0]
    K += np.einsum("nj,nk,nl,n->jkl", n[:, 0], twist, twist, weight * radius2, optimize=True)
    return np.asarray((K + K.transpose(0, 2, 1)) / 2)
