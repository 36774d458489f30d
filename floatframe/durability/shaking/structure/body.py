"""A reduced body on bases, with driven interfaces, its rigid motion and its modes.

x = (d, theta, q) contains the translation and rotation of the body frame, which only the bases constrain, and the
modes. Mass and stiffness are those of docs/theory.md §6 at rest. If the body was reduced with the ground held, the
ground is the base and moves d and theta.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.reduced_body import ReducedBody, ReducedInterface
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors, stiffness_scale
from cms.reduction.free_pencil import whole_pencil
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import STRESS_COMPONENTS, Array, symmetric_part
from fe_models.foundation.units import Units
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import DIRECTIONS, Base, Output, ShakenModel, rigid_rows
from floatframe.durability.shaking.structure.places import Observed, Place, found_places, in_mesh_axes, six_rows
from floatframe.durability.shaking.structure.recovery_rows import interface_loads, recovery_outputs, recovery_table
from floatframe.errors import ModelError

__all__ = ["Held", "bases_of_body", "force_outputs", "held_by_bases", "shaken_body"]


# exact elimination of driven interfaces: static motions that follow the bases, and modes with fixed bases -------------
#     M x_ddot + C x_dot + K x = f + Gᵀ lam,   G x = R s
#
# (1) N: a basis of the motions that hold the bases, G N = 0
# (2) x = T s + N y with G T = R and NᵀK T = 0: T is the static motion with the bases
# (3) modes of (NᵀK N, NᵀM N): V = N Z with unit mass; massless shapes V_0 with unit stiffness
# (4) eta_ddot + C_m eta_dot + omega² eta = -VᵀM T s_ddot - VᵀC T s_dot + Vᵀf
# (5) forces of the bases: Tᵀ(M x_ddot + C x_dot + K x - f), force and moment about their points


RANK = 1e-9  #: singular value of the scaled rows, relative to the largest, that counts as zero
FOLLOWS = 1e-8  #: largest relative error with which the structure follows the bases
FREE = 1e-12  #: energy of a motion with fixed bases, relative to the largest, below which the motion is free


@dataclass(frozen=True, eq=False)
class Held:
    """Motions of a structure on bases."""

    T: Array  #: static motions that follow the bases, (n_x, n_s)
    V: Array  #: modes with fixed bases and unit mass, (n_x, n_m)
    omega: Array  #: ascending angular frequencies of the modes, (n_m,)
    V_0: Array  #: shapes without mass, of unit stiffness, (n_x, n_0)


def held_by_bases(where: str, M: Array, K: Array, G: Array, R: Array, scale: Array, rigid: Array | None = None) -> Held:
    """Return the motions of a structure whose rows G x follow the motions s of bases, G x = R s.

    Parameters
    ----------
    where
        Name of the structure, for messages.
    M, K
        Symmetric mass and stiffness matrices, (n_x, n_x).
    G, R
        Constrained rows, (n_g, n_x), and their motion with the bases, (n_g, n_s).
    scale
        Magnitudes of x that move the structure by the same amount, (n_x,); they distinguish small entries of G from
        rounding errors.
    rigid
        T if it is known, (n_x, n_s), because a single base carries the whole structure rigidly.

    Raises
    ------
    ModelError
        If the structure cannot follow the bases, or they do not hold it.
    """
    S = scale
    size = np.linalg.norm(G * S, axis=1)
    rows = 1 / np.where(size > 0, size, 1.0)
    _, values, right = la.svd(rows[:, None] * G * S)
    rank = int((values > RANK * values[0]).sum()) if len(values) and values[0] > 0 else 0
    N = S[:, None] * right[rank:].T  # (1)
    K_N, M_N = symmetric_part(N.T @ K @ N), symmetric_part(N.T @ M @ N)
    require_held(where, K_N)
    if rigid is None:
        T_0 = S[:, None] * la.lstsq(rows[:, None] * G * S, rows[:, None] * R, cond=RANK)[0]
        require_followed(where, G @ T_0, R)
        T = T_0 - N @ la.solve(K_N, N.T @ (K @ T_0), assume_a="pos") if N.shape[1] else T_0  # (2)
    else:
        T = rigid
    if not N.shape[1]:
        return Held(T, N, np.zeros(0), N)
    try:
        Z, is_massive = elastic_eigenvectors(K_N, M_N, stiffness_scale(K_N, M_N))  # (3)
    except np.linalg.LinAlgError as error:
        raise ModelError(f"{where}: no modes with its bases held: {error}") from error
    omega2 = np.einsum("kq,kl,lq->q", Z, K_N, Z)
    order = np.lexsort((omega2, np.logical_not(is_massive)))
    Z, omega2, is_massive = Z[:, order], omega2[order], is_massive[order]
    V, static = N @ Z, np.logical_not(is_massive)
    return Held(T, V[:, is_massive], np.sqrt(omega2[is_massive]), V[:, static] / np.sqrt(omega2[static]))


def require_held(where: str, K_N: Array) -> None:
    """Raise `ModelError` if a motion with fixed bases has no energy."""
    if not len(K_N):
        return
    size = np.sqrt(np.maximum(np.diag(K_N), np.finfo(float).tiny))
    energy = la.eigvalsh(K_N / np.outer(size, size))
    free = int((energy <= FREE * max(energy[-1], np.finfo(float).tiny)).sum())
    if free:
        raise ModelError(
            f"{where}: its bases do not hold it: {free} motion{'s' if free > 1 else ''} without energy "
            f"remain{'' if free > 1 else 's'} with fixed bases; give a base an interface with rotations, or one more "
            "interface"
        )


def require_followed(where: str, followed: Array, wanted: Array) -> None:
    """Raise `ModelError` if static motions do not follow the bases."""
    defect = float(np.abs(followed - wanted).max() / np.abs(wanted).max())
    if defect > FOLLOWS:
        raise ModelError(
            f"{where}: its modes cannot follow relative motions of the bases (relative error {defect:.1e}), because "
            "it lacks static modes of the held interfaces. Reduce the body with a mode set that has one for each of "
            "their dofs (craig-bampton, guyan, rubin), or hold all interfaces with one base"
        )


# A reduced body on bases, with driven interfaces, its rigid motion and its modes --------------------------------------


GROUND = "ground"


def bases_of_body(
    body: ReducedBody, bases: Mapping[str, Sequence[str]] | str | None, points: Mapping[str, Array] | None = None
) -> tuple[Base, ...]:
    """Return the bases of a body, in mesh coordinates.

    Parameters
    ----------
    bases
        Interfaces that each base holds, by name of the base; or the name of one interface; None: the only
        interface, or the ground for a body that is already held.
    points
        Reference point of a base by name, mesh coordinates; default: that of its first interface.
    """
    where, names = f"shake: body {body.name!r}", [interface.name for interface in body.interfaces]
    points = points or {}
    if body.is_held:
        if bases not in (None, GROUND, {GROUND: ()}):
            raise ModelError(f'{where} is held to the ground, which is its only base: remove base, or write "{GROUND}"')
        return (Base(GROUND, (), np.asarray(points.get(GROUND, body.frame.origin), dtype=float)),)
    if bases is None:
        if len(names) != 1:
            raise ModelError(
                f"{where} has the interfaces {', '.join(names) or '(none)'}: name the one that the base holds"
            )
        bases = names[0]
    if isinstance(bases, str):
        bases = {bases: (bases,)}
    found = []
    for name, held in bases.items():
        if not held:
            raise ModelError(f"{where}: base {name!r}: expected at least one interface; choices: {', '.join(names)}")
        interfaces = [body.interface(other) for other in held]
        point = points.get(name, body.frame.origin + body.frame.axes @ interfaces[0].position)
        found.append(Base(name, tuple(held), np.asarray(point, dtype=float)))
    taken = [name for base in found for name in base.holds]
    twice = sorted({name for name in taken if taken.count(name) > 1})
    if twice:
        raise ModelError(f"{where}: interface {twice[0]!r} is held by two bases")
    return tuple(found)


@dataclass(frozen=True, eq=False)
class OutputRows:
    """Some outputs as functions of the modes and inputs, as in `ShakenModel`."""

    outputs: list[Output]
    E: Array  #: (3, n_out, n_m)
    D: Array  #: (3, n_out, n_s)


@dataclass(frozen=True, eq=False)
class OnBases:
    """A body with its motions on bases, and the loads on it."""

    body: ReducedBody
    bases: tuple[Base, ...]
    M: Array  #: mass matrix for the unknowns x, axes of B, (n_x, n_x)
    C: Array  #: damping matrix, zero if the damping is given by modes
    K: Array
    F: Array  #: loads of unit forces, (n_x, n_f)
    forces: tuple[str, ...]
    held: Held


def shaken_body(
    body: ReducedBody,
    bases: Sequence[Base],
    damping: Damping,
    observed: Sequence[Observed] = (),
    forces: Sequence[str] = (),
) -> ShakenModel:
    """Return a body on its bases (steps 4 and 5).

    Parameters
    ----------
    forces
        Further inputs: "interface:x" (a force, or moment for rx, ry, rz, mesh axes) or "load case NAME".

    Raises
    ------
    ModelError
        If the bases do not hold the body, its modes cannot follow them, or a name does not exist.
    """
    where, bases = f"shake: body {body.name!r}", tuple(bases)
    pencil = whole_pencil(body)
    M, K = np.asarray(pencil.M), np.asarray(pencil.K)
    G, R = held_rows(body, bases)
    rigid = rigid_motion(body, bases[0]) if len(bases) == 1 else None
    held = held_by_bases(where, M, K, G, R, sizes_of(body), rigid)
    if not len(held.omega):
        raise ModelError(f"{where}: no mode with mass is left with fixed bases, so that nothing vibrates")
    F = np.column_stack([force_column(body, name) for name in forces]) if forces else np.zeros((len(M), 0))
    own = np.asarray(pencil.D) if damping.own else np.zeros_like(M)
    on = OnBases(body, bases, M, own, K, F, tuple(forces), held)
    n_s, n_f = held.T.shape[1], F.shape[1]
    if damping.own:
        C = held.V.T @ own @ held.V
    else:
        C = np.diag(2 * damping.ratios(held.omega / (2 * np.pi) / body.units.time) * held.omega)
    B = np.zeros((3, len(held.omega), n_s + n_f))
    B[2, :, :n_s], B[0, :, n_s:] = -held.V.T @ M @ held.T, held.V.T @ F
    B[1, :, :n_s] = -held.V.T @ follows(on, own) if len(bases) > 1 else 0.0
    rows = [*base_rows(on), *(row for each in observed for row in observed_rows(on, each))]
    return ShakenModel(
        name=body.name,
        units=body.units,
        bases=bases,
        inputs=(*(f"{base.name}:{name}" for base in bases for name in DIRECTIONS), *forces),
        rates=np.array([2] * n_s + [0] * n_f),
        omega=held.omega,
        C=C,
        B=B,
        E=np.concatenate([row.E for row in rows], axis=1),
        D=np.concatenate([row.D for row in rows], axis=1),
        outputs=tuple(output for row in rows for output in row.outputs),
        mass=held.T.T @ M @ held.T,
        field=stress_field(on),
        field_labels=()
        if body.stress is None
        else (
            *(f"node {body.node_name(row)}" for row in range(len(body.nodes))),
            *(() if body.point_stress is None else body.point_stress.names),
        ),
    )


def follows(on: OnBases, matrix: Array) -> Array:
    """Return a stiffness or damping matrix times T; exactly zero if one base carries the whole body rigidly."""
    return np.zeros_like(on.held.T) if len(on.bases) == 1 else matrix @ on.held.T


def base_rows(on: OnBases) -> list[OutputRows]:
    """Return the forces of the bases on the body, individually and in total, and the mean acceleration (step 5)."""
    T, V, bases = on.held.T, on.held.V, on.bases
    n_s, n_f = T.shape[1], on.F.shape[1]
    E = np.stack([np.zeros((n_s, V.shape[1])), follows(on, on.C).T @ V, T.T @ on.M @ V])
    D = np.zeros((3, n_s, n_s + n_f))
    for rate, matrix in enumerate((follows(on, on.K), follows(on, on.C), on.M @ T)):
        D[rate, :, :n_s] = T.T @ matrix
    D[0, :, n_s:] = -T.T @ on.F
    units = on.body.units
    rows = [OutputRows([o for base in bases for o in force_outputs(base.name, "about its point", units)], E, D)]
    # the power of all wrenches in a common rigid motion with the first base gives the net force and moment
    to_net = np.vstack(
        [la.block_diag(base.axes, base.axes).T @ rigid_rows(base.point, bases[0]) for base in bases]
    ).T  # fmt: skip
    if len(bases) > 1:
        names = force_outputs("net", f"about the point of base {bases[0].name}", units)
        rows.append(OutputRows(names, to_net @ E, to_net @ D))
    per_mass = to_net[:3] / float(on.body.moments.m)
    names = [
        Output(f"mean acceleration {axis}", "acceleration", unit_of("acceleration", units), "mean acceleration",
               "net force of the bases divided by the mass")
        for axis in DIRECTIONS[:3]
    ]  # fmt: skip
    rows.append(OutputRows(names, per_mass @ E, per_mass @ D))
    return rows


def observed_rows(on: OnBases, each: Observed) -> list[OutputRows]:
    """Return the outputs of a place, or of the nodes of an element or set."""
    units, n_s = on.body.units, on.held.T.shape[1]
    if each.recovery is not None:
        return [table_rows(on, each)]
    found = []
    for place in found_places(on.body, each):
        for wish in each.quantities:
            if wish == "acceleration":
                found.append(rows_of(on, motion_outputs(place, wish, units), place.rows, 2, place.rows @ on.held.T))
            elif wish == "displacement":
                own = np.zeros((len(place.rows), n_s))
                if len(on.bases) > 1:  # minus the rigid motion with the first base; zero with one base
                    own = place.rows @ on.held.T
                    own[:, :6] -= rigid_rows(place.point, on.bases[0])[: len(own)]
                found.append(rows_of(on, motion_outputs(place, wish, units), place.rows, 0, own))
            elif place.stress is not None:
                found.append(rows_of(on, stress_outputs(place, units), place.stress, 0, place.stress @ on.held.T))
    return found


def table_rows(on: OnBases, each: Observed) -> OutputRows:
    """Return the rows of a recovery table, with the forces of the bases as its loads."""
    table, bases = recovery_table(on.body, each), base_rows(on)[0]
    by_lam, by_force = interface_loads(on.body, table, on.bases, on.forces)
    dynamic, n_s = np.asarray(table.dynamic), on.held.T.shape[1]
    E = dynamic @ on.held.V + by_lam @ bases.E
    D = by_lam @ bases.D
    follows_s = np.array(on.held.T)
    follows_s[:, :6] -= rigid_motion(on.body, on.bases[0])  # zero with one base
    D[:2, :, :n_s] += dynamic[:2] @ follows_s
    D[2, :, :n_s] += dynamic[2] @ on.held.T
    D[0, :, n_s:] += by_force + dynamic[0] @ (on.held.V_0 @ (on.held.V_0.T @ on.F))
    return OutputRows(recovery_outputs(each, table), E, D)


def rows_of(on: OnBases, outputs: list[Output], by_x: Array, rate: int, by_s: Array) -> OutputRows:
    """Return rows of d^rate x/dt^rate, of s by_s (n_out, 6 n_bases)."""
    n_s, n_f, V_0 = by_s.shape[1], on.F.shape[1], on.held.V_0
    E = np.zeros((3, len(outputs), on.held.V.shape[1]))
    D = np.zeros((3, len(outputs), n_s + n_f))
    E[rate], D[rate, :, :n_s] = by_x @ on.held.V, by_s
    if rate == 0:  # massless shapes follow forces immediately, so that their accelerations would be rates of the forces
        D[0, :, n_s:] = by_x @ V_0 @ (V_0.T @ on.F)
    return OutputRows(outputs, E, D)


def stress_field(on: OnBases) -> tuple[Array, Array] | None:
    """Return the stress of modes and inputs at all kept nodes, then at the stress points."""
    parts = [] if on.body.stress is None else [np.asarray(on.body.stress)]
    if on.body.point_stress is not None and on.body.stress is not None:
        parts.append(np.asarray(on.body.point_stress.modes))
    if not parts:
        return None
    modes, n_q = parts[0] if len(parts) == 1 else np.concatenate(parts), on.body.n_q
    of_s = np.zeros((len(modes), 6, on.held.T.shape[1] + on.F.shape[1]))
    of_s[:, :, : on.held.T.shape[1]] = modes @ on.held.T[-n_q:]
    of_s[:, :, on.held.T.shape[1] :] = modes @ (on.held.V_0[-n_q:] @ (on.held.V_0.T @ on.F))
    return modes @ on.held.V[-n_q:], of_s


def held_rows(body: ReducedBody, bases: Sequence[Base]) -> tuple[Array, Array]:
    """Return G and R, mesh axes: the constrained rows of x, and their motion with the bases."""
    G: list[Array] = []
    R: list[Array] = []
    for k, base in enumerate(bases):
        if body.is_held:
            held = [(base.point, in_mesh_axes(body, six_rows(body, base.point, np.zeros((6, body.n_q)))))]
        else:
            held = [point for name in base.holds for point in held_points(body, body.interface(name))]
        for point, rows in held:
            motion = np.zeros((len(rows), 6 * len(bases)))
            motion[:, 6 * k : 6 * k + 6] = rigid_rows(point, base)[: len(rows)]
            G.append(rows)
            R.append(motion)
    return np.concatenate(G), np.concatenate(R)


def held_points(body: ReducedBody, interface: ReducedInterface) -> list[tuple[Array, Array]]:
    """Return points of an interface, mesh coordinates, with the three or six rows of their motion over x, mesh axes.

    This is the reference point, or each member if the interface has no reference node of its own.
    """
    frame = body.frame
    if interface.kind == "nodes" and not (len(interface.members) == 1 and interface.has_rotation):
        points, Phi = body.nodes[interface.members], body.Phi[interface.members]
        rows = np.concatenate([rigid_motion_of_points(points, np.zeros(3)), Phi], axis=2)
        return [(frame.origin + frame.axes @ p, frame.axes @ r) for p, r in zip(points, rows, strict=True)]
    point = frame.origin + frame.axes @ interface.position
    rows = in_mesh_axes(body, six_rows(body, point, np.asarray(interface.Psi)))
    return [(point, rows if interface.has_rotation else rows[:3])]


def sizes_of(body: ReducedBody) -> Array:
    """Return magnitudes of x that move the body by about one unit of length, (6 + n_q,)."""
    length = float(np.linalg.norm(np.ptp(body.nodes, axis=0))) or 1.0
    largest = np.abs(body.Phi).max(axis=(0, 1), initial=0.0)
    for interface in body.interfaces:
        largest = np.maximum(largest, np.abs(np.asarray(interface.Psi)[:3]).max(axis=0))
        largest = np.maximum(largest, length * np.abs(np.asarray(interface.Psi)[3:]).max(axis=0))
    return np.concatenate([np.ones(3), np.full(3, 1 / length), 1 / np.where(largest > 0, largest, 1.0)])


def rigid_motion(body: ReducedBody, base: Base) -> Array:
    """Return x for a rigid motion of the body with a base, (6 + n_q, 6), without modes."""
    T = np.zeros((6 + body.n_q, 6))
    T[:6] = la.block_diag(body.frame.axes, body.frame.axes).T @ rigid_rows(body.frame.origin, base)
    return T


def force_column(body: ReducedBody, name: str) -> Array:
    """Return the load on x of a unit force, (6 + n_q,)."""
    column = np.zeros(6 + body.n_q)
    if name.startswith("load case "):
        case = body.load_case(name.removeprefix("load case "))
        column[:3], column[3:6], column[6:] = case.force, case.torque, case.h
        return column
    place, _, direction = name.rpartition(":")
    if direction not in DIRECTIONS or not place:
        raise ModelError(
            f"shake: force {name!r}: expected interface:component with one of {', '.join(DIRECTIONS)}, or "
            '"load case NAME"'
        )
    interface = body.interface(place)
    point = body.frame.origin + body.frame.axes @ interface.position
    return np.asarray(in_mesh_axes(body, six_rows(body, point, np.asarray(interface.Psi)))[DIRECTIONS.index(direction)])


# Names of outputs -----------------------------------------------------------------------------------------------------


def unit_of(kind: str, units: Units) -> str:
    """Return the unit of a kind of output."""
    length, force, second = units.length_symbol, units.force_symbol, units.time_symbol
    return {
        "acceleration": f"{length}/{second}²",
        "angular acceleration": f"rad/{second}²",
        "displacement": length,
        "rotation": "rad",
        "force": force,
        "moment": f"{force} {length}",
        "stress": units.stress_symbol,
    }[kind]


def force_outputs(name: str, place: str, units: Units) -> list[Output]:
    """Return force and moment of a base on the structure."""
    kinds = ("force",) * 3 + ("moment",) * 3
    return [
        Output(f"{name} {kind} {axis[-1]}", kind, unit_of(kind, units), f"{name} {kind}", place)
        for kind, axis in zip(kinds, DIRECTIONS, strict=True)
    ]


def motion_outputs(place: Place, quantity: str, units: Units) -> list[Output]:
    """Return the outputs of a motion: three translations, and three rotations if they exist."""
    turning = {"acceleration": "angular acceleration", "displacement": "rotation"}[quantity]
    kinds = [quantity] * 3 + [turning] * (len(place.rows) - 3)
    return [
        Output(f"{place.name} {kind} {axis[-1]}", kind, unit_of(kind, units), f"{place.name} {kind}", place.words)
        for kind, axis in zip(kinds, DIRECTIONS, strict=False)
    ]


def stress_outputs(place: Place, units: Units) -> list[Output]:
    """Return the six components of a stress."""
    group = f"{place.name} stress"
    return [Output(f"{group} {c}", "stress", unit_of("stress", units), group, place.words) for c in STRESS_COMPONENTS]
