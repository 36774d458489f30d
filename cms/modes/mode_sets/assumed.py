"""Assumed modes of a slender body: functions along its axis, combined with the kinematics of a beam section."""

from collections.abc import Iterator, Sequence

import numpy as np

from cms.errors import ModeSetError
from cms.modes.families.families import Families, body_of
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.axis_functions import AXIS_FUNCTIONS, AxisFunctions, axis_functions
from cms.modes.mode_sets.mesh_field import coupled_field
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["assumed_modes"]

NEGLIGIBLE = 1e-9  #: displacement of a column relative to its beam field, below which the column is omitted
#: relative difference of the two smallest principal moments of inertia that is needed to identify the axis
SLENDER_RATIO = 1e-6


def assumed_modes(
    body: FEBody | Families,
    *,
    n_modes: int | None = None,
    n_axial: int | None = None,
    n_bending: int | None = None,
    n_torsion: int | None = None,
    functions: str = "legendre",
    axis: Sequence[float] | None = None,
    point: Sequence[float] | None = None,
    poisson: float | None = None,
) -> ModeSet:
    """Assumed-mode set of a slender body: [Psi_R, axial, bending about both section axes, torsion].

    With axis t, axial coordinate s = t·(c - p) and position r = c - p - s t in the section, the field of each function
    is

    (1) axial u(s):            u t - [nu u' r]
    (2) bending w(s) along e:  w e - (e·r) w' t + [nu w'' ((e·r) r - (r·r) e / 2)],  rotation w' t × e
        (Euler-Bernoulli: sections stay normal to the bent axis)
    (3) torsion theta(s):      theta t × r, rotation theta t  (Saint-Venant without warping)

    The fields are evaluated at the nodes. The terms in brackets are the lateral contraction. A solid needs them:
    without contraction its bending stiffness is too large by the factor (1 - nu) / ((1 + nu) (1 - 2 nu)). If `poisson`
    is given, the contraction is part of each field. Otherwise it is a separate column with nu = 1 and its own
    amplitude. It is left out if all nodes lie on one line along the axis, as for a beam. Degree 0 (and 1 for bending)
    is rigid-body motion, which Psi_R provides. [1]_

    Parameters
    ----------
    body
        A coupled body, or its `Families`, which several sets can share.
    n_modes
        Number of functions for each of the four motions for which no number is given.
    n_axial, n_bending, n_torsion
        Number of functions for this motion; n_bending counts for each of the two directions.
    functions
        "legendre", "monomials" (ill-conditioned beyond about 10) or "splines" (cubic, over equal parts of the span).
    axis, point
        Direction of the axis and a point on it, (3,) [m]; default: the principal axis of least inertia through the
        centre of mass.
    poisson
        Poisson's ratio nu of a single material; None: separate contraction columns.

    Raises
    ------
    ModeSetError
        If numbers are missing or negative, the family is unknown, or the body has no distinct axis.

    References
    ----------
    .. [1] With contraction, the field is the exact solution for a prismatic bar in tension and in pure bending
       (Saint-Venant), see docs/theory.md.
    """
    body = body_of(body)
    body.require_coupled()
    if functions not in AXIS_FUNCTIONS:
        raise ModeSetError(f"assumed_modes: unknown functions {quoted(functions)}{nearest(functions, AXIS_FUNCTIONS)}")
    if poisson is not None and not -1 < poisson <= 0.5:
        raise ModeSetError(f"assumed_modes: poisson = {poisson}; expected a number between -1 and 0.5")
    counts = _counts(n_modes, n_axial, n_bending, n_torsion)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    p, t, e_1, e_2 = section_axes(body, Psi_R, axis, point)
    mesh_dofs = body.dofs if body.recovery is None else body.recovery.dofs
    node, component = mesh_dofs.T
    d = body.nodes - p
    s = d @ t
    r = d - np.outer(s, t)
    span = np.array([s[node].min(), s[node].max()])
    if not np.ptp(span) > 0:
        raise ModeSetError(f"assumed_modes: body {body.name!r} has no length along ({_numbers(t)})")

    # skin nodes of a beam follow other nodes, and have no dofs themselves
    moving = body.dofs[body.dofs[:, 1] >= 0, 0]
    has_sections = bool(np.ptp(r[moving], axis=0).max() > NEGLIGIBLE * np.ptp(span))

    columns, labels, groups = [], [], []
    for motion, direction, first in (
        ("axial", None, 1),
        ("bending", e_1, 2),
        ("bending", e_2, 2),
        ("torsion", None, 1),
    ):
        f = axis_functions(functions, s, span, counts[motion], first) if counts[motion] else None
        if f is None:
            continue
        group = motion if direction is None else f"{motion} along ({_numbers(direction)})"
        for k, name in enumerate(f.names):
            for what, shape in _fields(motion, f, k, t, direction, r, poisson if has_sections else 0.0):
                columns.append(_sample(shape, node, component))
                labels.append(f"{group}{what} {name}")
                groups.append(group + what)
    field = coupled_field(body, np.array(columns).T if columns else np.zeros((len(mesh_dofs), 0)))
    size = np.abs(field.columns).max(axis=0, initial=0.0)
    is_kept = size > NEGLIGIBLE * size.max(initial=0.0)
    kept = np.flatnonzero(is_kept)
    n_rigid = Psi_R.shape[1]
    return ModeSet(
        "assumed-modes",
        np.hstack([Psi_R, field.columns[:, kept]]),
        (*(f"rigid-body {name}" for name in MOTION_COMPONENTS), *(labels[k] for k in kept)),
        np.full(n_rigid + len(kept), np.nan),
        {
            "functions": functions,
            **{f"n_{motion}": str(count) for motion, count in counts.items()},
            "axis": _numbers(t),
            "point": _numbers(p),
            "poisson": "free contraction" if poisson is None else repr(float(poisson)),
        },
        (*["rigid-body"] * n_rigid, *(groups[k] for k in kept)),
    )


def section_axes(
    body: FEBody, Psi_R: Array, axis: Sequence[float] | None, point: Sequence[float] | None
) -> tuple[Array, Array, Array, Array]:
    """Return a point on the axis, its direction t, and the principal axes e_1, e_2 of the section, (3,) each."""
    rigid_mass = Psi_R.T @ (body.M @ Psi_R)
    m = rigid_mass[0, 0]
    if not m > 0:
        raise ModeSetError(f"assumed_modes: body {body.name!r} has no mass; expected a positive mass")
    center = np.array([rigid_mass[1, 5], rigid_mass[2, 3], rigid_mass[0, 4]]) / m
    J = rigid_mass[3:, 3:] - m * (center @ center * np.eye(3) - np.outer(center, center))
    moments, directions = np.linalg.eigh(J)
    p = center if point is None else np.asarray(point, dtype=float)
    if axis is None:
        if moments[1] - moments[0] <= SLENDER_RATIO * moments[2]:
            raise ModeSetError(
                f"assumed_modes: body {body.name!r}: its least principal moments of inertia {moments[0]:.4g} and "
                f"{moments[1]:.4g} determine no axis; give axis = [x, y, z]"
            )
        t = directions[:, 0]
        t = t * np.sign(t[np.argmax(np.abs(t))])
    else:
        t = np.asarray(axis, dtype=float)
        if t.shape != (3,) or not np.isfinite(t).all() or not np.linalg.norm(t) > 0:
            raise ModeSetError(f"assumed_modes: axis = {axis}; expected a direction [x, y, z]")
        t = t / np.linalg.norm(t)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise ModeSetError(f"assumed_modes: point = {point}; expected a point [x, y, z]")
    # principal axes of the section: a large eigenvalue is added for t, which eigh then returns last
    across = np.eye(3) - np.outer(t, t)
    _, e = np.linalg.eigh(across @ J @ across + 10 * np.trace(J) * np.outer(t, t))
    e_1 = e[:, 0] * np.sign(e[np.argmax(np.abs(e[:, 0])), 0])
    return p, t, e_1, np.cross(t, e_1)


def _counts(n_modes: int | None, axial: int | None, bending: int | None, torsion: int | None) -> dict[str, int]:
    counts = {}
    for motion, own in (("axial", axial), ("bending", bending), ("torsion", torsion)):
        count = n_modes if own is None else own
        if count is None:
            raise ModeSetError(f"assumed_modes: expected n_modes or n_{motion}, got neither")
        if count < 0:
            raise ModeSetError(f"assumed_modes: n_{motion} = {count}; expected 0 or more")
        counts[motion] = count
    return counts


def _fields(
    motion: str, f: AxisFunctions, k: int, t: Array, e: Array | None, r: Array, poisson: float | None
) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Yield beam field and lateral contraction of each function: translations and rotations, (n_nodes, 3) each."""
    value, slope, curvature = (table[:, k, None] for table in (f.values, f.slopes, f.curvatures))
    still = np.zeros_like(r)
    if motion == "torsion":
        yield "", (value * np.cross(t, r), value * t)
        return
    if e is None:
        beam, contraction = (value * t, still), -slope * r
    else:
        y = (r @ e)[:, None]
        beam = (value * e - y * slope * t, slope * np.cross(t, e))
        contraction = curvature * (y * r - (r * r).sum(axis=1)[:, None] * e / 2)
    if poisson is None:
        yield "", beam
        yield " contraction", (contraction + still, still)
    else:
        yield "", (beam[0] + poisson * contraction, beam[1] + still)


def _sample(field: tuple[Array, Array], node: Array, component: Array) -> Array:
    """Return the values of a field at the dofs, (n_mesh_dof,); zero for multipliers."""
    table = np.concatenate(np.broadcast_arrays(*field), axis=1)
    return np.where(component >= 0, table[node, np.maximum(component, 0)], 0.0)


def _numbers(x: Array) -> str:
    return ", ".join(f"{value:.6g}" for value in np.where(np.abs(x) < 1e-12 * np.abs(x).max(initial=1.0), 0.0, x))
