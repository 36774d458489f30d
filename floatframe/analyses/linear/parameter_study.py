"""System modes over a parameter: root locus and Campbell diagram, modes followed by their shapes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import Equilibrium, steady_rotation
from floatframe.analyses.linear.channels import AnyOutput, outputs_of
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.analyses.snapshot import snapshot
from floatframe.checked_values import array_of_shape, unit_vector
from floatframe.errors import ModelError
from floatframe.system import System

__all__ = ["Locus", "campbell", "root_locus"]


@dataclass(frozen=True, eq=False)
class Locus:
    """Eigenvalues over a parameter; a column follows one mode."""

    parameter: str  #: its name, with its unit
    values: Array  #: (n_values,)
    eigenvalues: Array  #: (n_values, n_modes) complex [1/s]; NaN where a mode has no counterpart
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

    Parameters
    ----------
    build
        From a value of the parameter to the linearised system (same bodies and modes for every value).
    values
        In steps small enough that shapes change little from one to the next, (n_values,).
    parameter
        What it is, for tables and plots.
    n_modes
        How many to follow, by ascending |lambda| at the first value; all by default.
    progress
        Called with the numbers of values done and of all values.
    """
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or len(values) == 0:
        raise ModelError(f"root_locus: values: expected a list of numbers, got shape {values.shape}")
    modes = system_modes(build(float(values[0])))
    n = len(modes.eigenvalues) if n_modes is None else min(n_modes, len(modes.eigenvalues))
    table = np.full((len(values), n), np.nan + 0j)
    table[0] = modes.eigenvalues[:n]
    shapes, last = with_states(modes)[:, :n], modes.eigenvalues[:n]
    for done, (row, value) in enumerate(zip(table[1:], values[1:], strict=True), start=1):
        if progress is not None:
            progress(done, len(values))
        modes = system_modes(build(float(value)))
        others = with_states(modes)
        apart = distance(shapes, others)
        if modes.states:  # modes of states alone, or that decay, have shapes which tell little
            apart = apart + far(last, modes.eigenvalues)
        rows, columns = linear_sum_assignment(apart)
        row[rows] = modes.eigenvalues[columns]
        shapes, last = shapes.copy(), last.copy()
        shapes[:, rows], last[rows] = others[:, columns], modes.eigenvalues[columns]
    return Locus(parameter, values, table)


def with_states(modes: SystemModes) -> Array:
    """Return the shapes of modes with those of states below, each state measured by its largest share in a mode."""
    if not modes.states:
        return modes.shapes
    largest = np.abs(modes.state_shapes).max(axis=1, keepdims=True)
    return np.vstack([modes.shapes, modes.state_shapes / np.where(largest > 0, largest, 1.0)])


def far(eigenvalues: Array, others: Array) -> Array:
    """Return how far eigenvalues are from others, relative to their sizes, between 0 and 1, (n, n_others)."""
    a, b = eigenvalues[:, None], others[None]
    size = np.abs(a) + np.abs(b)
    return np.asarray(np.divide(np.abs(a - b), size, out=np.zeros(size.shape), where=size > 0))


def distance(shapes: Array, others: Array) -> Array:
    """Return 1 - MAC of shapes and other ones, (n, n_others)."""
    a, b = shapes / np.linalg.norm(shapes, axis=0), others / np.linalg.norm(others, axis=0)
    return 1 - np.abs(a.conj().T @ b) ** 2


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
        Its joints to the ground must allow the rotation.
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
    seen: list[dict[str, tuple[float, str]]] = []
    observed = outputs_of(system.outputs) if outputs is None else tuple(outputs)

    def at(speed: float) -> LinearSystem:
        state = last[0].state if last else None
        last[:] = [steady_rotation(system, speed * axis, center=center, state=state)]
        seen.append(steady_values(system, last[0], observed))
        return linearize(system, last[0], inputs=(), outputs=())

    locus = root_locus(at, speeds, parameter="speed [rad/s]", n_modes=n_modes, progress=progress)
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
