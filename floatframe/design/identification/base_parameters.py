"""Base parameters: the smallest set of parameter combinations that determines torques or reactions.

All directions N of the parameters that change nothing, (p, k), are found either by rules (`silent_directions`,
`silent_at_base`) or by the rank of a sampled linear form. Then k parameters are left out, chosen such that the rest is
well determined, and their effect is added to the remaining parameters:

    phi = (phi_1, phi_2),   N = (N_1, N_2):     beta = phi_1 - N_1 N_2⁻¹ phi_2,      Y phi = Y_1 beta.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.words import nearest, quoted
from floatframe.design.identification.inertial_parameters import PAIRS, parameters_in, point_mass
from floatframe.design.identification.regressors import LinearForm
from floatframe.design.identification.tree_samples import TreeSamples, as_placed, gravity_of, rigid_tree, tree_samples
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.topology import CoordinateName, tree_of
from floatframe.errors import ModelError

__all__ = [
    "SAME",
    "SOURCES",
    "BaseParameters",
    "Move",
    "base_parameters",
    "chain",
    "common",
    "dipole",
    "form_rows",
    "moves_of",
    "passing",
    "random_samples",
    "rotations",
    "sampled_silence",
    "silent_at_base",
    "silent_directions",
    "square_to",
    "tensor_row",
    "typical_coordinates",
    "typical_forces",
    "typical_parameters",
    "typical_rows",
    "typical_time",
]


# parameters of a tree without effect on torques, by rules over its joints: base parameters in closed form -------------
# Three kinds of changes of the parameters do not change any torque. All vectors are in ground axes at the placed
# configuration (a: direction of a rotation through p):
#
# (1) Transfers: parts of the inertia of body i that can be moved to its parent, because the joint between them does not
#     move them. A rotation transfers masses on its axis (a mass at p, and its first and second derivative along a). A
#     translation transfers every inertia tensor without mass; if it is along e and all rotations before it are parallel
#     to e, also first moments normal to e. A joint of several coordinates transfers the parts that each of them
#     transfers. Parts that are transferred to the ground have no effect.
# (2) Parameters that have no effect in any possible motion of their own body, which the joints between the body and the
#     ground determine:
#     If none of these joints rotates, S and J have no effect; if none translates either, m has none.
#     If all rotations are parallel to e, S·e and J except e·J e have no effect. If in addition all rotation axes lie on
#     one line and all translations are along it, a mass on the line has no effect unless there is a translation, and
#     the rest of S has none if gravity is along e or zero.
#     If there are several directions of rotation, all axes meet in one point and nothing translates, a mass at the
#     point has no effect; nor has S about it if there is no gravity.
# (3) Inertia of a drive that acts like inertia of its body. For the first rotation, and for rotations that stay normal
#     to all rotations before them: the inertia of the rotor and e·J e of the body. For a translation, if earlier
#     translations and gravity are normal to it and earlier rotations are parallel to it: the inertia of the drive and
#     the mass.
#
# Completeness of the rules is proven only for the kinds of joints named. `base_parameters` finds the same directions by
# the rank of sampled regressors, and tests compare both over trees of all kinds. The rules for chains of single
# rotations and translations are those of Gautier & Khalil (1990) [1]_, stated without a convention of frames.
#
# References
# ----------
# .. [1] Gautier & Khalil (1990), IEEE Transactions on Robotics and Automation 6, 368-373.


SAME = 1e-9  #: sine of an angle, or distance relative to the size of the system, that counts as zero


@dataclass(frozen=True, eq=False)
class Move:
    """A joint coordinate at the placed configuration, as a rotation or translation."""

    turn: Array  #: direction of the rotation, (3,); zero for a translation
    shift: Array  #: direction of the translation, (3,); zero for a rotation
    point: Array  #: point on the axis, (3,)


def silent_directions(form: LinearForm) -> Array:
    """Return independent directions of the parameters, (p, k), that do not change any torque of the tree.

    Raises
    ------
    ModelError
        If the tree has a screw joint, for which there is no rule, or terms that hide each other.
    """
    system = form.system
    tree, moves, to_ground = placed_moves(form)
    n_c, n_b = len(tree.side), len(tree.parent)
    gravity = gravity_of(system)
    found: list[Array] = []

    def note(i: int, phi: Array, parent: int = -1, drive: int = -1) -> None:
        """Record that phi at body i, minus phi at its parent, minus one at a drive, has no effect."""
        direction = np.zeros(len(form.names))
        direction[10 * i : 10 * i + 10] = la.solve(to_ground[i], phi)
        if parent >= 0:
            direction[10 * parent : 10 * parent + 10] = -la.solve(to_ground[parent], phi)
        if drive >= 0:
            direction[form.n_inertial + n_c * form.terms.index("motor-inertia") + drive] = -1.0
        found.append(direction)

    for i in range(n_b):
        parent = int(tree.parent[i])
        way = [move for j in chain(tree, i) for move in moves[j]]
        before = [move for j in chain(tree, parent) for move in moves[j]]
        for phi in passing(moves[i], before, unweighed_dipoles):
            note(i, phi, parent)
        for phi in without_effect(way, gravity):
            note(i, phi)
        if "motor-inertia" in form.terms:
            for k, move in enumerate(moves[i]):
                if len(moves[i]) > 1:
                    raise ModelError(
                        f"system {system.name!r}: rules of base parameters: motor-inertia: the joint of body "
                        f"{system.bodies[i].name!r} has {len(moves[i])} coordinates, and rules are for one; find the "
                        "base parameters by samples"
                    )
                for phi, is_relative in drive_twins(move, before, gravity):
                    note(i, phi, parent if is_relative else -1, int(tree.column0[i]) + k)
    if not found:
        return np.zeros((len(form.names), 0))
    U, s, _ = la.svd(np.array(found).T, full_matrices=False)
    return typical_parameters(form)[:, None] * U[:, s > 1e-9 * s[0]]


def placed_moves(form: LinearForm) -> tuple[Tree, list[list[Move]], list[Array]]:
    """Return the tree, the moves of the joint of each body as placed, and the transfers of parameters to the ground."""
    system = form.system
    tree = rigid_tree(system, f"system {system.name!r}: rules of base parameters").tree
    zero = np.zeros((1, len(tree.side)))
    placed = tree_samples(system, as_placed(system)[None], zero, zero)
    size, bodies = compiled_system(system).length, range(len(tree.parent))
    moves = [moves_of(form, placed, tree, i, size) for i in bodies]
    return tree, moves, [parameters_in(placed.r[0, i] / size, placed.R[0, i]) for i in bodies]


def moves_of(form: LinearForm, placed: TreeSamples, tree: Tree, i: int, size: float) -> list[Move]:
    """Return the coordinates of the joint of body i, starting at its parent, in lengths of the system."""
    made = []
    first, end = int(tree.column0[i]), int(tree.column0[i + 1])
    for k in range(first, end):
        turn, shift = placed.turn[0, k], placed.t[0, k]
        if np.linalg.norm(turn) > 0 and np.linalg.norm(shift) > 0:
            name = form.columns[k].joint
            raise ModelError(
                f"system {form.system.name!r}: joint {name!r} is a screw, for which there is no closed rule; find the "
                "base parameters by samples"
            )
        made.append(Move(turn, shift, placed.point[0, k] / size))
    return made


def chain(tree: Tree, i: int) -> list[int]:
    """Return the bodies from the ground to body i."""
    way: list[int] = []
    while i >= 0:
        way.append(i)
        i = int(tree.parent[i])
    return way[::-1]


def line_masses(move: Move) -> Array:
    """Return a basis of the parameters of masses on the axis of a rotation, (3, 10)."""
    one, p, a = point_mass(move.point), move.point, move.turn
    ahead, behind = point_mass(p + a), point_mass(p - a)
    return np.array([one, 0.5 * (ahead - behind), 0.5 * (ahead + behind) - one])


def tensors() -> Array:
    """Return a basis of the inertia tensors without mass, (6, 10)."""
    return np.eye(10)[4:]


def dipole(p: Array, d: Array) -> Array:
    """Return the parameters of a first moment d at p without mass, (10,)."""
    return 0.5 * (point_mass(p + d) - point_mass(p - d))


def common(spaces: list[Array]) -> Array:
    """Return a basis, as rows, of the intersection of row spaces, in lengths of the system."""
    kept = spaces[0]
    for space in spaces[1:]:
        if not len(kept):
            break
        null = la.null_space(np.vstack([kept, -space]).T, rcond=1e-9)
        kept = la.orth((null[: len(kept)].T @ kept).T, rcond=1e-9).T
    return kept


def passing(own: list[Move], before: list[Move], dipoles: Callable[[list[Move], Array], Array]) -> Array:
    """(1) Return the parameters that can be transferred from a body to its parent, as rows of 10.

    dipoles: function from the moves before a translation and its direction to the first moments without mass, (k, 10),
    that the translation transfers.
    """
    if not own:
        return np.eye(10)
    spaces = []
    for k, move in enumerate(own):
        if move.shift.any():
            space = np.vstack([tensors(), dipoles(before + own[:k], move.shift)])
        else:
            space = line_masses(move)
        spaces.append(space)
    return common(spaces)


def unweighed_dipoles(before: list[Move], shift: Array) -> Array:
    """Return the first moments normal to a translation along the common axis of all previous rotations."""
    e, _ = rotations(before)
    if e is None or np.linalg.norm(np.cross(e, shift)) >= SAME:
        return np.zeros((0, 10))
    return np.array([dipole(np.zeros(3), d) for d in square_to(e)])


def rotations(moves: list[Move]) -> tuple[Array | None, bool]:
    """Return the common direction of all rotations, and whether their directions differ.

    The direction is None if they differ or nothing rotates.
    """
    e: Array | None = None
    for move in moves:
        if move.turn.any():
            if e is None:
                e = move.turn / np.linalg.norm(move.turn)
            elif np.linalg.norm(np.cross(e, move.turn)) > SAME:
                return None, True
    return e, False


def square_to(e: Array) -> Array:
    """Return two unit vectors normal to e, (2, 3)."""
    return la.null_space(e[None]).T


def tensor_row(J: Array) -> Array:
    """Return the parameters of an inertia tensor without mass, (10,)."""
    return np.array([0.0] * 4 + [J[pair] for pair in PAIRS])


def without_effect(way: list[Move], gravity: Array) -> list[Array]:
    """(2) Return the parameters of a body that have no effect for its possible motions."""
    e, are_several = rotations(way)
    shifts = [move.shift for move in way if move.shift.any()]
    turns = [move for move in way if move.turn.any()]
    still = np.zeros(3)
    has_gravity = bool(gravity.any())
    if not turns:
        silent = [dipole(still, axis) for axis in np.eye(3)] + list(tensors())
        return silent if shifts else [*silent, point_mass(still)]
    if are_several:
        centre = common_point(turns)
        if shifts or centre is None:
            return []
        about = [] if has_gravity else [dipole(centre, axis) for axis in np.eye(3)]
        return [point_mass(centre), *about]
    assert e is not None
    across = square_to(e)
    silent = [dipole(still, e)]
    axes = (e, *across)
    silent += [
        tensor_row(np.outer(x, y) + np.outer(y, x)) for a, x in enumerate(axes) for y in axes[a:] if a or y is not e
    ]
    point = turns[0].point
    stays = all(np.linalg.norm(np.cross(e, move.point - point)) < SAME for move in turns)
    stays = stays and all(np.linalg.norm(np.cross(e, shift)) < SAME for shift in shifts)
    if stays:
        if not shifts:
            silent.append(point_mass(point))
        if np.linalg.norm(np.cross(e, gravity)) <= SAME * np.linalg.norm(gravity):
            silent += [dipole(point, d) for d in across]
    return silent


def common_point(turns: list[Move]) -> Array | None:
    """Return the common point of all axes of rotation, or None."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for move in turns:
        a = move.turn / np.linalg.norm(move.turn)
        across = np.eye(3) - np.outer(a, a)
        A += across
        b += across @ move.point
    centre = la.solve(A, b, assume_a="sym")
    misses = [np.linalg.norm(np.cross(move.turn, centre - move.point)) for move in turns]
    return centre if max(misses) < SAME else None


def drive_twins(move: Move, earlier: list[Move], gravity: Array) -> list[tuple[Array, bool]]:
    """(3) Return body parameters that act like drive inertia, and whether the parent's parameters are subtracted."""
    if move.turn.any():
        if all(abs(move.turn @ other.turn) < SAME for other in earlier if other.turn.any()):
            directions = [other for other in earlier if other.turn.any()]
            _, are_several = rotations(directions)
            if not are_several:
                return [(tensor_row(np.outer(move.turn, move.turn)), False)]
        return []
    if any(np.linalg.norm(np.cross(other.turn, move.shift)) > SAME for other in earlier):
        return []
    if abs(move.shift @ gravity) > SAME * np.linalg.norm(gravity):
        return []
    if any(abs(move.shift @ other.shift) > SAME for other in earlier):
        return []
    return [(point_mass(np.zeros(3)), True)]


# which parameters of a tree do nothing to the ground reaction: base parameters of reactions ---------------------------
# The reaction of the ground is the rate of the momentum of all bodies minus their weight. Parameters have no effect on
# it if they contribute no linear and no angular momentum in any motion, and no weight and no moment of weight in the
# placed configuration (without momentum, their first moment is constant). In the terms of the rules for torques above:
#
# (1) Transfers: masses along the axis of a rotation, inertia tensors without mass through a translation, and a first
#     moment along the translation if all rotations before it, if any, have its direction. Parts that are transferred to
#     the ground have no momentum.
# (2) If all rotations between a body and the ground are parallel to e: inertia tensors normal to e (J e = 0).
# (3) Drives act between two bodies, so that their parameters have no effect on the ground.
# (4) Directions of (1) and (2) have no momentum; only those without weight and moment of weight have no effect. They
#     solve six equations: force and moment of gravity in the placed configuration are zero.
#
# The balance of momentum proves each rule, but not that the rules are complete. `base_parameters` finds the same
# directions by the rank of sampled regressors, and tests compare both over trees of all kinds.


def silent_at_base(form: LinearForm) -> Array:
    """Return independent directions of the parameters, (p, k), that do not change any ground reaction.

    Raises
    ------
    ModelError
        If the tree has a screw joint, for which there is no rule.
    """
    system = form.system
    tree, moves, to_ground = placed_moves(form)
    n_b, p = len(tree.parent), len(form.names)
    found: list[Array] = []  # parameters of all bodies, in ground axes about its origin, without momentum
    for i in range(n_b):
        parent = int(tree.parent[i])
        before = [move for j in chain(tree, parent) for move in moves[j]]
        for phi in passing(moves[i], before, still_dipoles):
            direction = np.zeros((n_b, 10))
            direction[i] = phi
            if parent >= 0:
                direction[parent] = -phi
            found.append(direction)
        for phi in without_momentum([*before, *moves[i]]):
            direction = np.zeros((n_b, 10))
            direction[i] = phi
            found.append(direction)
    drives = np.eye(p)[:, form.n_inertial :]  # (3)
    if not found:
        return drives
    at_ground = la.orth(np.array(found).reshape(-1, 10 * n_b).T, rcond=SAME).reshape(n_b, 10, -1)
    gravity = gravity_of(system)
    weightless = at_ground @ unseen(weight(at_ground, gravity), SAME * np.linalg.norm(gravity))
    inertial = np.concatenate([la.solve(to_ground[i], weightless[i]) for i in range(n_b)])
    if inertial.shape[1]:
        inertial = la.orth(inertial)
    silent = np.hstack([np.vstack([inertial, np.zeros((p - 10 * n_b, inertial.shape[1]))]), drives])
    return typical_parameters(form)[:, None] * silent


def unseen(weights: Array, least: np.floating) -> Array:
    """Return orthonormal directions, (k, n), with a weight of at most `least`, the rounding error of transfers."""
    _, s, Vt = la.svd(weights)
    return Vt[int((s > least).sum()) :].T


def still_dipoles(before: list[Move], shift: Array) -> Array:
    """Return the first moment along a translation, (1, 10), if all preceding rotations have its direction (1)."""
    e, are_several = rotations(before)
    if are_several or (e is not None and np.linalg.norm(np.cross(e, shift)) >= SAME):
        return np.zeros((0, 10))
    return dipole(np.zeros(3), shift)[None]


def without_momentum(way: list[Move]) -> list[Array]:
    """Return the inertia tensors of a body, (10,) each, that never rotate about an axis with inertia (2)."""
    e, _ = rotations(way)
    if e is None:
        return []
    across = square_to(e)
    return [tensor_row(np.outer(x, y) + np.outer(y, x)) for a, x in enumerate(across) for y in across[a:]]


def weight(at_ground: Array, gravity: Array) -> Array:
    """Return force and moment of gravity about the origin, (6, k), of parameters in ground axes, (n_b, 10, k) (4)."""
    total = at_ground.sum(axis=0)
    return np.vstack([np.outer(gravity, total[0]), np.cross(total[1:4], gravity, axis=0)])


# base parameters ------------------------------------------------------------------------------------------------------


SOURCES = ("torques", "reactions", "both")
RANK = 1e-9  #: largest singular value that counts as zero, relative to the largest one, in typical magnitudes
SHOWN = 1e-9  #: largest factor of a combination that counts as zero, relative to the largest one
N_SAMPLES = 60  #: smallest number of random instants per body
#: range of samples of a system with loops about its placed position, so that loops stay closed [rad, or system sizes]
LOOP_REACH = 0.3


@presented
@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Combinations beta = B phi of parameters."""

    form: LinearForm
    source: str  #: the measured quantities, one of `SOURCES`
    kept: IntArray  #: leading parameter of each combination, (n_base,)
    B: Array  #: (n_base, p), the identity in the columns `kept`
    #: directions without effect, orthonormal where parameters are divided by `typical_parameters`, (p, k)
    silent: Array

    @property
    def names(self) -> tuple[str, ...]:
        """The combinations as formulas: "J_zz(link1) + J_yy(link2) + 0.25 m(link3)"."""
        return tuple(formula(row, self.form.names, lead) for row, lead in zip(self.B, self.kept, strict=True))

    @property
    def without_effect(self) -> tuple[str, ...]:
        """Names of parameters without any effect."""
        is_used = np.any(self.B, axis=0).tolist()
        return tuple(name for name, used in zip(self.form.names, is_used, strict=True) if not used)

    def values(self, phi: Array) -> Array:
        """Return beta, (n_base,), from parameters, (p,)."""
        return self.B @ np.asarray(phi)

    def rows(self, Y: Array) -> Array:
        """Return the columns of a linear form, (..., p), for the combinations, (..., n_base)."""
        return Y[..., self.kept]


def base_parameters(form: LinearForm, *, source: str = "torques", by: str = "rules", seed: int = 0) -> BaseParameters:
    """Return the base parameters of a linear form.

    Parameters
    ----------
    form
        See `linear_form`.
    source
        What is measured: "torques" of all coordinates, "reactions" of the ground, or "both".
    by
        "rules" over the joints, or "samples": the rank of the form over random motions.
    seed
        Seed of the random motions.

    Raises
    ------
    ModelError
        If a name is unknown, or there is no rule.
    """
    if source not in SOURCES:
        raise ModelError(f"base_parameters: source: expected one of {', '.join(SOURCES)}, got {source!r}")
    if by not in ("rules", "samples"):
        raise ModelError(f"base_parameters: by: no method {quoted(by)}{nearest(by, ['rules', 'samples'])}")
    if by == "rules":
        silent = silent_by_rules(form, source)
    else:
        silent = sampled_silence(form, random_samples(form, seed), source)
    return combined(form, source, silent)


def silent_by_rules(form: LinearForm, source: str) -> Array:
    """Return the directions of the parameters, (p, k), that have no effect on the measurements, by rules."""
    if form.independent is not None:
        raise ModelError(
            f"system {form.system.name!r}: rules of base parameters hold for trees, but its joints close loops; "
            "find the base parameters by samples"
        )
    if source == "torques":
        return silent_directions(form)
    if source == "reactions":
        return silent_at_base(form)
    size = typical_parameters(form)[:, None]
    spaces = [(silent / size).T for silent in (silent_directions(form), silent_at_base(form))]
    return common(spaces).T * size


def random_samples(form: LinearForm, seed: int = 0) -> TreeSamples:
    """Return random instants with angles over a full turn, or near the placed position if there are loops."""
    rng = np.random.default_rng(seed)
    size, time = typical_coordinates(form, form.columns), typical_time(form)
    if form.independent is None:
        x = rng.uniform(-np.pi, np.pi, (N_SAMPLES * len(form.system.bodies), len(size))) * size
    else:
        x = rng.uniform(-LOOP_REACH, LOOP_REACH, (max(N_SAMPLES, 2 * len(form.names)), len(size))) * size
        x += as_placed(form.system)[form.independent]
    return form.samples(x, rng.normal(size=x.shape) * size / time, rng.normal(size=x.shape) * size / time**2)


def form_rows(form: LinearForm, samples: TreeSamples, source: str) -> Array:
    """Return the rows of the measured quantities, (n rows, p)."""
    parts = []
    if source != "reactions":
        parts.append(form.torques(samples))
    if source != "torques":
        parts.append(form.reactions(samples))
    return np.concatenate(parts, axis=1).reshape(-1, len(form.names))


def typical_rows(form: LinearForm, rows: Array, source: str) -> Array:
    """Return rows of measured quantities divided by typical magnitudes of forces and parameters, (n rows, p)."""
    forces, p = typical_forces(form, source), len(form.names)
    return (rows.reshape(-1, len(forces), p) * typical_parameters(form) / forces[:, None]).reshape(-1, p)


def sampled_silence(form: LinearForm, samples: TreeSamples, source: str) -> Array:
    """Return independent directions without effect, from the singular values of sampled rows."""
    rows = typical_rows(form, form_rows(form, samples, source), source)
    _, s, Vt = la.svd(rows, full_matrices=False)
    return Vt[s <= RANK * s[0]].T * typical_parameters(form)[:, None]


# typical magnitudes: bodies of mass 1 and of the size of the system, which fall by half this size in the typical time


def typical_time(form: LinearForm) -> float:
    """Return the time in which a weight falls by half the size of the system, or 1 without gravity."""
    g = float(np.linalg.norm(gravity_of(form.system)))
    return float(np.sqrt(compiled_system(form.system).length / g)) if g > 0 else 1.0


def typical_coordinates(form: LinearForm, columns: Sequence[CoordinateName]) -> Array:
    """Return typical magnitudes of coordinates, the size of the system or a radian, (n_c,)."""
    size = compiled_system(form.system).length
    return np.array([size if column.unit == "m" else 1.0 for column in columns])


def typical_parameters(form: LinearForm) -> Array:
    """Return typical magnitudes of the parameters of bodies and drives, (p,)."""
    size, time = compiled_system(form.system).length, typical_time(form)
    x = typical_coordinates(form, tree_of(form.system).columns)
    # typical drive force divided by the drive parameter; 1 for the other terms
    factors = {"motor-inertia": x / time**2, "viscous": x / time}
    drives = [(size / time) ** 2 / x / factors.get(term, 1.0) for term in form.terms]
    return np.concatenate([*([1.0], [size] * 3, [size**2] * 6) * len(form.system.bodies), *drives])


def typical_forces(form: LinearForm, source: str) -> Array:
    """Return typical magnitudes of the measured forces and torques, (n_channels,)."""
    size, work = compiled_system(form.system).length, (compiled_system(form.system).length / typical_time(form)) ** 2
    parts = []
    if source != "reactions":
        parts.append(work / typical_coordinates(form, form.columns))
    if source != "torques":
        parts.append(work / np.array([size] * 3 + [1.0] * 3))
    return np.concatenate(parts)


def combined(form: LinearForm, source: str, silent: Array) -> BaseParameters:
    """Return combinations led by parameters of outer bodies if possible, moments of inertia before masses.

    Parameters are eliminated one by one, each from the direction in which it is largest, in the order of `preference`.
    """
    p, k = silent.shape
    size = typical_parameters(form)
    N = silent / size[:, None]
    left_out: list[int] = []
    rest = N.copy()
    for j in preference(form):
        if len(left_out) == k:
            break
        row = rest[j]
        if np.linalg.norm(row) > 1e-6 * max(np.linalg.norm(N[j]), np.abs(N).max() * 1e-3):
            left_out.append(j)
            row = row / np.linalg.norm(row)
            rest = rest - np.outer(rest @ row, row)
    kept = np.array([j for j in range(p) if j not in set(left_out)], dtype=np.int64)
    B = np.zeros((len(kept), p))
    B[np.arange(len(kept)), kept] = 1.0
    if left_out:
        out = np.array(left_out)
        B[:, out] = -la.solve(N[out].T, N[kept].T).T * (size[kept][:, None] / size[out][None])
    B[np.abs(B) * size[None] < SHOWN * size[kept][:, None]] = 0.0
    return BaseParameters(form, source, kept, B, la.orth(silent / size[:, None]) * size[:, None] if k else silent)


def preference(form: LinearForm) -> list[int]:
    """Return the parameters in order of elimination, from the tips: masses, first moments, inertias."""
    order = (0, 3, 2, 1, 7, 4, 9, 5, 6, 8)
    bodies = range(len(form.system.bodies) - 1, -1, -1)
    inertial = [10 * i + k for k in order[:1] for i in bodies] + [10 * i + k for k in order[1:] for i in bodies]
    return inertial + list(range(form.n_inertial, len(form.names)))


def formula(row: Array, names: Sequence[str], lead: int) -> str:
    """Return a combination as a formula that begins with its leading parameter."""
    words = names[lead]
    for j, name in enumerate(names):
        if j == lead or row[j] == 0.0:
            continue
        factor = abs(row[j])
        number = "" if abs(factor - 1) < SHOWN else f"{factor:.6g} "
        words += f" {'-' if row[j] < 0 else '+'} {number}{name}"
    return words
