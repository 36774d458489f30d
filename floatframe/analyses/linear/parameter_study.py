"""System modes as functions of a parameter (root locus, Campbell diagram); modes are tracked by their shapes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.equilibrium import steady_rotation
from floatframe.analyses.linear.channels import AnyOutput, named_output, outputs_of
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.analyses.snapshot import Equilibrium, snapshot
from floatframe.analyses.steady.turning_drives import turning_with
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.checked_values import array_of_shape, unit_vector
from floatframe.model.system import System

__all__ = ["Locus", "campbell", "root_locus"]

LIKE = 0.5  #: smallest squared cosine between the shapes of the same mode at neighbouring parameter values
SAME = 1e-2  #: relative difference of eigenvalues below which they count as equal, so that their shapes mix
CLOSE = 0.1  #: weight of the distance between eigenvalues, relative to the weight of the distance between shapes
ALIKE = 0.25  #: difference of shape distances below which eigenvalues decide how modes continue
CLEAR = 0.5  #: largest change of eigenvalues by which they decide, relative to the change for the other choice
ROUNDING = float(np.sqrt(np.finfo(float).eps))  #: error of a double eigenvalue, relative to the largest eigenvalue
MOST_HALVINGS = 3  #: largest number of times that a parameter step is halved if a mode is lost


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Locus(Tabular):
    """Eigenvalues as functions of a parameter; each column follows one mode.

    Parameters
    ----------
    parameter
        Name of the parameter, with its unit.
    values
        Values of the parameter, (n_values,).
    eigenvalues
        (n_values, n_modes) complex [1/s]; NaN where the mode does not exist.
    outputs
        Names of the outputs of `campbell`.
    output_units
        Unit of each output.
    steady
        Steady values of outputs, (n_values, n_outputs).
    """

    parameter: str
    values: Array
    eigenvalues: Array
    outputs: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    steady: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def frequencies(self) -> Array:
        """Damped frequencies |Im(lambda)|/2 pi, (n_values, n_modes) [1/unit of time]."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios -Re(lambda)/|lambda|, (n_values, n_modes)."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros(size.shape), where=size > 0)

    def to_table(self, time_unit: float = 1.0) -> Table:
        """Return the parameter, frequencies in Hz, damping ratios and steady outputs, one row per value.

        time_unit: the unit of time of the system [s].
        """
        n = range(self.eigenvalues.shape[1])
        columns = {
            self.parameter.partition(" [")[0]: self.values,
            **{f"Hz {k + 1}": self.frequencies[:, k] / time_unit for k in n},
            **{f"damping {k + 1}": self.damping_ratios[:, k] for k in n},
            **dict(zip(self.outputs, self.steady.T, strict=True)),
        }
        return Table(columns, dict(zip(self.outputs, self.output_units, strict=True)))


def root_locus(
    build: Callable[[float], LinearSystem],
    values: Sequence[float] | Array,
    *,
    parameter: str = "parameter",
    n_modes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Locus:
    """Follow the modes of a system while a parameter changes.

    Two modes at neighbouring values are the same mode if their shapes share more than half of their kinetic energy. A
    mode whose frequency passes zero, such as a whirl in axes that rotate with a rotor at its critical speed, continues
    in the conjugate of a mode. If shapes are alike, as those of both whirls above that speed, eigenvalues decide,
    provided that they change little compared with their difference. If a mode is lost or undecided in a step, the step
    is halved, up to three times. After that, its column ends. A new mode begins a new column.

    Parameters
    ----------
    build
        Returns the linearised system for a value of the parameter; all systems have the same bodies and modes.
    values
        Values of the parameter, in steps so small that shapes change little from one to the next, (n_values,).
    parameter
        Name of the parameter, for tables and plots.
    n_modes
        Number of modes to follow at each value, by ascending |lambda|; default: all.
    progress
        Called with the number of completed values and the number of all values.
    """
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or len(values) == 0:
        raise ModelError(f"root_locus: values: expected a list of numbers, got shape {values.shape}")
    first = modes_at(build(float(values[0])))
    n = len(first.eigenvalues) if n_modes is None else min(n_modes, len(first.eigenvalues))
    followed = [Branch(first, k) for k in range(n)]
    table = [[branch.eigenvalue for branch in followed]]
    for done, (before, value) in enumerate(pairwise(values.tolist()), start=1):
        if progress is not None:
            progress(done, len(values))
        now = follow(build, followed, before, value, MOST_HALVINGS)
        met = {branch.number for branch in followed if branch.at == value}
        followed += [Branch(now, k, value) for k in range(min(n, len(now.eigenvalues))) if k not in met]
        table.append(
            [branch.eigenvalue if branch.at in (None, value) else complex(np.nan, np.nan) for branch in followed]
        )
    rows = np.full((len(values), len(followed)), complex(np.nan, np.nan))
    for row, found in zip(rows, table, strict=True):
        row[: len(found)] = found
    return Locus(parameter, values, rows)


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes at one parameter value.

    Shapes are scaled so that their squared length is the kinetic energy; states are appended with their largest share.
    """

    eigenvalues: Array
    shapes: Array  #: mode shapes of unit length, (n_u + n_states, n_modes)
    has_states: bool


@dataclass(eq=False)
class Branch:
    """A tracked mode at the last parameter value at which it was found."""

    modes: Modes
    number: int
    at: float | None = None  #: last parameter value at which the mode was found
    is_conjugate: bool = False  #: whether the tracked mode is the conjugate, with negative frequency
    shape: Array = field(init=False)  #: shape of unit length, separated from other modes with the same eigenvalue

    def __post_init__(self) -> None:
        self.shape = self.modes.shapes[:, self.number]

    def meet(self, modes: Modes, number: int, is_conjugate: bool, value: float) -> None:
        """Continue with a mode at a value; the last shape is projected onto all modes with its eigenvalue."""
        Q, own = of_same(modes, number), modes.shapes[:, number]
        if is_conjugate:
            Q, own = Q.conj(), own.conj()
        if Q.shape[1] > 1:
            own = Q @ (Q.conj().T @ self.shape)
        self.shape = own / np.linalg.norm(own)
        self.modes, self.number, self.is_conjugate, self.at = modes, number, is_conjugate, value

    @property
    def eigenvalue(self) -> complex:
        """The eigenvalue at the last value, with non-negative frequency."""
        return complex(self.modes.eigenvalues[self.number])

    @property
    def followed_eigenvalue(self) -> complex:
        """The eigenvalue of the tracked mode, whose frequency may be negative."""
        return self.eigenvalue.conjugate() if self.is_conjugate else self.eigenvalue

    @property
    def space(self) -> Array:
        """Orthonormal basis of all shapes with the same eigenvalue."""
        Q = of_same(self.modes, self.number)
        return Q.conj() if self.is_conjugate else Q


def modes_at(linear: LinearSystem) -> Modes:
    """Return the modes of a linear system."""
    modes = system_modes(linear)
    shapes = np.vstack([root_of(mass) @ modes.shapes[rows] for rows, mass in linear.bodies()])
    shapes = shapes / max(np.abs(shapes).max(initial=0.0), np.finfo(float).tiny)
    if modes.states:
        largest = np.abs(modes.state_shapes).max(axis=1, keepdims=True)
        shapes = np.vstack([shapes, modes.state_shapes / np.where(largest > 0, largest, 1.0)])
    length = np.linalg.norm(shapes, axis=0)
    return Modes(modes.eigenvalues, shapes / np.where(length > 0, length, 1.0), bool(modes.states))


def root_of(mass: Array) -> Array:
    """Return a square root of a body's mass matrix that depends continuously on the matrix.

    It is the symmetric square root in coordinates with diagonal masses of 1. In the units of translations, rotations
    and modes, the eigenvalues of the matrix would be too far apart for a small or large body.
    """
    size = np.sqrt(np.diag(mass))
    scale = 1 / np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(scale[:, None] * mass * scale)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T * size)


def follow(
    build: Callable[[float], LinearSystem], followed: list[Branch], before: float, value: float, n_halvings: int
) -> Modes:
    """Track branches to a parameter value, in two half steps if one is lost; return all modes at the value."""
    now = modes_at(build(value))
    pairs = matches(followed, now, before)
    if n_halvings and len(pairs) < sum(branch.at in (None, before) for branch in followed):
        middle = 0.5 * (before + value)
        follow(build, followed, before, middle, n_halvings - 1)
        return follow(build, followed, middle, value, n_halvings - 1)
    for branch, number, is_conjugate in pairs:
        branch.meet(now, number, is_conjugate, value)
    for branch in followed:
        if branch.at is None:
            branch.at = before
    return now


def matches(followed: list[Branch], now: Modes, before: float) -> list[tuple[Branch, int, bool]]:
    """Return branches present at the last value, their modes at this value, and whether these are conjugates.

    A branch may continue in a mode, or in its conjugate, if more than half of the mode's shape lies in the shape of the
    branch, or in the space of all shapes with the same eigenvalue. Shapes mix where eigenvalues cross or are double, as
    for a rotor at rest. Lost and undecided branches are left out.
    """
    alive = [branch for branch in followed if branch.at in (None, before)]
    if not alive or not len(now.eigenvalues):
        return []
    as_found, conjugate = distances(alive, now, is_conjugate=False), distances(alive, now, is_conjugate=True)
    is_conjugate = conjugate.apart < as_found.apart
    d = Distances(*(np.where(is_conjugate, b, a) for a, b in zip(as_found, conjugate, strict=True)))
    rows, columns = linear_sum_assignment(d.apart)
    last = np.array([branch.followed_eigenvalue for branch in alive])
    values = np.where(is_conjugate, now.eigenvalues.conj(), now.eigenvalues)
    pairs = np.ix_(rows, columns)
    is_open = undecided(d.like[pairs], d.shapes[pairs], last[rows], values[pairs])
    joined = (d.like[rows, columns] >= LIKE) & np.logical_not(is_open)
    return [
        (alive[i], int(j), bool(is_conjugate[i, j]))
        for i, j, is_joined in zip(rows, columns, joined, strict=True)
        if is_joined
    ]


class Distances(NamedTuple):
    """Measures of how well each mode continues each branch, all (n_branches, n_modes)."""

    like: Array  #: squared projection of the shape on the space of the other
    shapes: Array  #: distance between shapes, 0 to 1
    values: Array  #: distance between eigenvalues, 0 to 1
    apart: Array  #: weighted sum of the distances of shapes and eigenvalues


def distances(alive: list[Branch], now: Modes, *, is_conjugate: bool) -> Distances:
    """Return distances between branches and modes, or between branches and conjugates of modes."""
    modes = replace(now, eigenvalues=now.eigenvalues.conj(), shapes=now.shapes.conj()) if is_conjugate else now
    last = np.array([branch.followed_eigenvalue for branch in alive])
    own = np.stack([branch.shape for branch in alive], axis=1)
    like = np.array([part_within(branch.space, modes.shapes) for branch in alive])
    back = np.array([part_within(of_same(modes, k), own) for k in range(len(modes.eigenvalues))])
    like = np.maximum(like, back.T)
    alone = np.abs(own.conj().T @ modes.shapes) ** 2
    shapes, values = 1 - 0.5 * (like + alone), far(last, modes.eigenvalues)
    # shapes of decaying modes, and of modes that consist of states, identify a mode poorly
    return Distances(like, shapes, values, shapes + (CLOSE + (1.0 if modes.has_states else 0.0)) * values)


def undecided(like: Array, shapes: Array, last: Array, values: Array) -> Array:
    """Return which assigned pairs of branch and mode could be assigned otherwise just as well, (n_pairs,).

    Two pairs could be exchanged if their shapes are alike, their eigenvalues differ, and the eigenvalues of a pair are
    not clearly closer to each other than to those of the other pair. `values`, (n_pairs, n_pairs): the eigenvalue, or
    its conjugate, with which the mode of pair k would continue the branch of pair i.
    """
    kept, found = np.diag(shapes), np.diag(values)
    moves = np.abs(last[:, None] - values)
    own = np.diag(moves)
    exchange = (like >= LIKE) & (like.T >= LIKE) & differ(last, last) & differ(found, found)
    exchange &= shapes + shapes.T - kept[:, None] - kept < ALIKE
    exchange &= own[:, None] + own > CLEAR * (moves + moves.T)
    return np.asarray(exchange.any(axis=1))


def differ(eigenvalues: Array, others: Array) -> np.ndarray:
    """Return whether eigenvalues differ from others by more than their accuracy, (n, n_others)."""
    size = np.abs(eigenvalues)[:, None] + np.abs(others)
    return np.asarray(np.abs(eigenvalues[:, None] - others) > SAME * size + ROUNDING * size.max(initial=0.0))


def of_same(modes: Modes, number: int) -> Array:
    """Return an orthonormal basis of all shapes with the same eigenvalue as a mode."""
    own, size = modes.eigenvalues[number], np.abs(modes.eigenvalues)
    Q, _ = np.linalg.qr(modes.shapes[:, np.abs(modes.eigenvalues - own) <= SAME * abs(own) + ROUNDING * size.max()])
    return np.asarray(Q)


def part_within(Q: Array, shapes: Array) -> Array:
    """Return the squared length of each shape's projection onto a basis, (n,)."""
    return np.asarray((np.abs(Q.conj().T @ shapes) ** 2).sum(axis=0))


def far(eigenvalues: Array, others: Array) -> Array:
    """Return distances between eigenvalues and others, 0 to 1, relative to their sizes, (n, n_others)."""
    a, b = eigenvalues[:, None], others[None]
    size = np.abs(a) + np.abs(b)
    return np.asarray(np.divide(np.abs(a - b), size, out=np.zeros(size.shape), where=size > 0))


def campbell(
    system: System,
    speeds: Sequence[float] | Array,
    *,
    axis: Array | tuple[float, float, float] = (0.0, 0.0, 1.0),
    center: Array | tuple[float, float, float] = (0.0, 0.0, 0.0),
    n_modes: int | None = None,
    outputs: Sequence[AnyOutput | str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Locus:
    """Return frequencies and damping of a steadily rotating system as functions of its speed, in the rotating frame.

    Parameters
    ----------
    system
        The system. Its joints to the ground must allow the rotation; prescribed angles relative to the ground are
        replaced by rotations at each speed.
    speeds
        Angular speeds, ascending, (n_speeds,) [rad/s].
    axis, center
        Direction and a point of the axis of rotation, ground axes, (3,).
    n_modes
        Number of modes to follow; default: all.
    outputs
        Sensors, channels or names, whose steady values are returned (`Locus.steady`), such as bearing forces over the
        speed. None: the outputs of the system.
    progress
        Called with the number of completed speeds and the number of all speeds.
    """
    axis = unit_vector("campbell: axis", axis)
    center = array_of_shape("campbell: center", center, (3,))
    last: list[Equilibrium] = []
    seen_at: dict[float, dict[str, tuple[float, str]]] = {}
    observed = [named_output(system, each) for each in (outputs_of(system.outputs) if outputs is None else outputs)]

    def at(speed: float) -> LinearSystem:
        state = last[0].state if last else None
        driven = turning_with(system, speed * axis)
        try:
            last[:] = [steady_rotation(driven, speed * axis, center=center, state=state)]
        except ConvergenceError:  # the equilibrium at the last speed may be too far away, as beyond a critical speed
            last[:] = [steady_rotation(driven, speed * axis, center=center)]
        seen_at[speed] = steady_values(driven, last[0], observed)
        return linearize(driven, last[0], inputs=(), outputs=())

    locus = root_locus(at, speeds, parameter="speed [rad/s]", n_modes=n_modes, progress=progress)
    seen = [seen_at[speed] for speed in locus.values.tolist()]
    names = [name for name in seen[0] if all(name in each for each in seen)]
    steady = np.array([[each[name][0] for name in names] for each in seen])
    return replace(locus, outputs=tuple(names), output_units=tuple(seen[0][name][1] for name in names), steady=steady)


def steady_values(system: System, about: Equilibrium, outputs: Sequence[AnyOutput]) -> dict[str, tuple[float, str]]:
    """Return value and unit of every output column in a steady motion; a single column has the sensor's name.

    Raises
    ------
    ModelError
        If two columns have the same name.
    """
    now = snapshot(system, about)
    found: dict[str, tuple[float, str]] = {}
    for output in outputs:
        measured = output.measure(system, now)
        for column, values in measured.columns.items():
            name = output.name if len(measured.columns) == 1 else f"{output.name}.{column}"
            if name in found:
                raise ModelError(f"campbell: two outputs are called {name!r}; rename one")
            found[name] = (float(values[0]), measured.units[column])
    return found
