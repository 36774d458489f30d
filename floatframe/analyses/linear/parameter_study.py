"""System modes over a parameter: root locus and Campbell diagram, modes followed by their shapes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import Equilibrium, steady_rotation
from floatframe.analyses.linear.channels import AnyOutput, outputs_of
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.analyses.snapshot import snapshot
from floatframe.analyses.steady.turning_drives import turning_with
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.checked_values import array_of_shape, unit_vector
from floatframe.model.system import System

__all__ = ["Locus", "campbell", "root_locus"]

LIKE = 0.5  #: part of a shape that lies in another one, by squares, of what may be one mode
SAME = 1e-2  #: difference of eigenvalues, relative, of which shapes mix
CLOSE = 0.1  #: weight of distances of eigenvalues beside those of shapes
MOST_HALVINGS = 3  #: of a step between values, where a mode is not met again


@dataclass(frozen=True, eq=False)
class Locus:
    """Eigenvalues over a parameter; a column follows one mode."""

    parameter: str  #: its name, with its unit
    values: Array  #: (n_values,)
    eigenvalues: Array  #: (n_values, n_modes) complex [1/s]; NaN where a mode has no counterpart, or is not yet there
    outputs: tuple[str, ...] = ()  #: of `campbell`
    output_units: tuple[str, ...] = ()
    steady: Array = field(default_factory=lambda: np.zeros((0, 0)))  #: their steady values, (n_values, n_outputs)

    @property
    def frequencies(self) -> Array:
        """Im(lambda)/2 pi, (n_values, n_modes) [Hz]."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """-Re(lambda)/|lambda|, (n_values, n_modes)."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros(size.shape), where=size > 0)


def root_locus(
    build: Callable[[float], LinearSystem],
    values: Sequence[float] | Array,
    *,
    parameter: str = "parameter",
    n_modes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Locus:
    """Follow the modes of a system while a parameter changes.

    A mode is joined to one of which more than half of the shape is its own, by kinetic energy; a step in which one is
    not met again is halved, up to three times. Then its column ends, and what is new has a column of its own.

    Parameters
    ----------
    build
        From a value of the parameter to the linearised system (same bodies and modes for every value).
    values
        In steps small enough that shapes change little from one to the next, (n_values,).
    parameter
        What it is, for tables and plots.
    n_modes
        How many to follow at each value, by ascending |lambda|; all by default.
    progress
        Called with the numbers of values done and of all values.
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
    """Modes at one value; shapes are measured by their kinetic energy, states below by their largest share."""

    eigenvalues: Array
    shapes: Array  #: of length one, (n_u + n_states, n_modes)
    has_states: bool


@dataclass(eq=False)
class Branch:
    """A mode that is followed, where it was met last."""

    modes: Modes
    number: int
    at: float | None = None  #: the value
    shape: Array = field(init=False)  #: its own, also where others have the same eigenvalue, of length one

    def __post_init__(self) -> None:
        self.shape = self.modes.shapes[:, self.number]

    def meet(self, modes: Modes, number: int, value: float) -> None:
        """Go on with a mode: the part of its shape that lies in those of one eigenvalue, where there are several."""
        Q = of_same(modes, number)
        own = Q @ (Q.conj().T @ self.shape) if Q.shape[1] > 1 else modes.shapes[:, number]
        self.shape = own / np.linalg.norm(own)
        self.modes, self.number, self.at = modes, number, value

    @property
    def eigenvalue(self) -> complex:
        """Its eigenvalue there."""
        return complex(self.modes.eigenvalues[self.number])


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
    """Return the symmetric S with S S the mass matrix of a body: the one that changes as little as the matrix does."""
    values, vectors = np.linalg.eigh(mass)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def follow(
    build: Callable[[float], LinearSystem], followed: list[Branch], before: float, value: float, n_halvings: int
) -> Modes:
    """Follow branches to a value, by half the way first where one is not met again; return all modes there."""
    now = modes_at(build(value))
    pairs = matches(followed, now, before)
    if n_halvings and len(pairs) < sum(branch.at in (None, before) for branch in followed):
        middle = 0.5 * (before + value)
        follow(build, followed, before, middle, n_halvings - 1)
        return follow(build, followed, middle, value, n_halvings - 1)
    for branch, number in pairs:
        branch.meet(now, number, value)
    for branch in followed:
        if branch.at is None:
            branch.at = before
    return now


def matches(followed: list[Branch], now: Modes, before: float) -> list[tuple[Branch, int]]:
    """Return which of the branches met at the last value is which mode now; those that none is like are left out.

    A branch is like a mode of whose shape more than half lies in its own, or in those of the same eigenvalue as it has:
    where eigenvalues cross, or are double as those of a rotor that stands, shapes of one eigenvalue mix.
    """
    alive = [branch for branch in followed if branch.at in (None, before)]
    if not alive or not len(now.eigenvalues):
        return []
    last = np.array([branch.eigenvalue for branch in alive])
    shapes = np.stack([branch.shape for branch in alive], axis=1)
    like = np.array([part_within(of_same(branch.modes, branch.number), now.shapes) for branch in alive])
    back = np.array([part_within(of_same(now, k), shapes) for k in range(len(now.eigenvalues))])
    like = np.maximum(like, back.T)
    alone = np.abs(shapes.conj().T @ now.shapes) ** 2
    apart = 1 - 0.5 * (like + alone) + CLOSE * far(last, now.eigenvalues)
    if now.has_states:  # modes of states alone, or that decay, have shapes which tell little
        apart = apart + far(last, now.eigenvalues)
    rows, columns = linear_sum_assignment(apart)
    return [(alive[i], int(j)) for i, j in zip(rows, columns, strict=True) if like[i, j] >= LIKE]


def of_same(modes: Modes, number: int) -> Array:
    """Return an orthonormal basis of the shapes that have the eigenvalue of a mode."""
    own = modes.eigenvalues[number]
    Q, _ = np.linalg.qr(modes.shapes[:, np.abs(modes.eigenvalues - own) <= SAME * np.abs(own)])
    return np.asarray(Q)


def part_within(Q: Array, shapes: Array) -> Array:
    """Return the part of shapes, by squares, that lies in a basis, (n,)."""
    return np.asarray((np.abs(Q.conj().T @ shapes) ** 2).sum(axis=0))


def far(eigenvalues: Array, others: Array) -> Array:
    """Return how far eigenvalues are from others, relative to their sizes, between 0 and 1, (n, n_others)."""
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
    outputs: Sequence[AnyOutput] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Locus:
    """Frequencies and damping of a system that turns steadily, over its speed, as seen from the turning system.

    Parameters
    ----------
    system
        Its joints to the ground must allow the rotation; drives of angles against the ground turn with each speed.
    speeds
        Angular speeds, ascending, (n_speeds,) [rad/s].
    axis, center
        Direction and a point of the axis of rotation, ground axes, (3,).
    n_modes
        How many modes to follow.
    outputs
        Sensors and channels whose steady values are kept (`Locus.steady`), such as bearing forces over the speed.
        None: those of the system.
    progress
        Called with the numbers of speeds done and of all speeds.
    """
    axis = unit_vector("campbell: axis", axis)
    center = array_of_shape("campbell: center", center, (3,))
    last: list[Equilibrium] = []
    seen_at: dict[float, dict[str, tuple[float, str]]] = {}
    observed = outputs_of(system.outputs) if outputs is None else tuple(outputs)

    def at(speed: float) -> LinearSystem:
        state = last[0].state if last else None
        driven = turning_with(system, speed * axis)
        try:
            last[:] = [steady_rotation(driven, speed * axis, center=center, state=state)]
        except ConvergenceError:  # that of another speed may be too far, as beyond a critical one
            last[:] = [steady_rotation(driven, speed * axis, center=center)]
        seen_at[speed] = steady_values(driven, last[0], observed)
        return linearize(driven, last[0], inputs=(), outputs=())

    locus = root_locus(at, speeds, parameter="speed [rad/s]", n_modes=n_modes, progress=progress)
    seen = [seen_at[speed] for speed in locus.values.tolist()]
    names = [name for name in seen[0] if all(name in each for each in seen)]
    steady = np.array([[each[name][0] for name in names] for each in seen])
    return replace(locus, outputs=tuple(names), output_units=tuple(seen[0][name][1] for name in names), steady=steady)


def steady_values(system: System, about: Equilibrium, outputs: Sequence[AnyOutput]) -> dict[str, tuple[float, str]]:
    """Return value and unit of every column of outputs in a steady motion; one of one column goes by its own name.

    Raises
    ------
    ModelError
        If two columns have one name.
    """
    now = snapshot(system, about)
    found: dict[str, tuple[float, str]] = {}
    for output in outputs:
        measured = output.measure(system, now)
        for column, values in measured.columns.items():
            name = output.name if len(measured.columns) == 1 else f"{output.name}.{column}"
            if name in found:
                raise ModelError(f"campbell: two outputs are called {name!r}; give each its own name")
            found[name] = (float(values[0]), measured.units[column])
    return found
