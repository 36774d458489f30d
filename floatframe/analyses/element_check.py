"""Validation of an element's law: array sizes, values, derivatives, and equilibrium of its wrenches."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.callbacks.law_functions import called_law
from floatframe.engine.compiling.callbacks.law_slopes import difference_slopes
from floatframe.engine.compiling.markers import marker_pose
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.model.elements.element import ACTS
from floatframe.model.joints.rows import POSITION, VELOCITY
from floatframe.model.rotations import rotation_exp
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.element_motion import placed_law

__all__ = ["ElementCheck", "check_element"]

N_SAMPLES = 3  #: number of motions at which the law is evaluated; the first is the state to be checked
NEAR = 1e-3  #: distance of the other motions from the first, relative to the size of the system, or in rad
MOVING = 0.1  #: velocities of the other motions, in system sizes per unit of time, or in rad per unit of time
DERIVATIVE = 1e-5  #: smallest reported error of a derivative, relative to the largest derivative in the same row
ROUNDING = 1e-9  #: rounding error of values, relative to their magnitude
AXES = "xyz"


@presented
@dataclass(frozen=True)
@checked_fields(ModelError)
class ElementCheck:
    """The findings about an element.

    Parameters
    ----------
    name
        Name of the element.
    findings
        Description of each fault, one sentence each.
    derivative_error
        Largest difference from finite differences, relative to the largest entry of the row.
    """

    name: str
    findings: tuple[str, ...]
    derivative_error: float

    @property
    def is_good(self) -> bool:
        """Whether there are no findings."""
        return not self.findings


def check_element(system: System, name: str, state: State | None = None) -> ElementCheck:
    """Check the law of an element at a state (default: assembled) and at two motions near it.

    (1) in Python, with arrays of the exact sizes, the function stays within them and raises no error
    (2) all outputs are finite numbers, reproducible, and equal to those of the compiled function
    (3) components of wrenches excluded by `acts` are zero, and forces are opposite if so declared
    (4) the derivatives used by the engine agree with finite differences
    (5) position constraints depend only on positions and time, velocity constraints not on multipliers

    Parameters
    ----------
    system
        The system with the element.
    name
        Name of the element.
    state
        State at which the law is checked; None: as assembled.

    Raises
    ------
    ResultsError
        If there is no such element.
    """
    placed = placed_law(system, name, "check_element")
    findings = told_in_python(placed, placed_inputs(system, placed), "as placed")
    if findings:  # the compiled function might write outside its arrays
        return ElementCheck(name, tuple(findings), np.inf)
    try:
        samples = sample_inputs(system, placed, state)
    except ModelError as error:
        return ElementCheck(name, (str(error),), np.inf)
    worst = 0.0
    for sample, inputs in enumerate(samples):
        where = "as placed" if sample == 0 else "near its place, in motion"
        findings += told_in_python(placed, inputs, where)
        values = values_of(placed, inputs)
        if not np.isfinite(values).all():
            at = [row_name(placed, int(k)) for k in np.flatnonzero(~np.isfinite(values))]
            findings.append(f"{where}: {', '.join(at[:3])}: expected a finite number, got NaN or infinity")
            continue
        findings += balance(placed, values, where)
        own, other = own_slopes(placed, inputs), differences(placed, inputs)
        worst = max(worst, relative_error(len(placed.markers), own, other).max(initial=0.0))
        findings += wrong_slopes(placed, own, other, where)
        findings += wrong_dependence(placed, other, where)
    return ElementCheck(name, tuple(dict.fromkeys(findings)), worst)


def values_of(placed: PlacedLaw, inputs: Array) -> Array:
    """Call the law as the engine does, and return all its outputs."""
    n_all = placed.n_out + len(placed.law.outputs)
    values = called_law(placed.value.address, placed.head, np.asarray(placed.law.data), inputs[None], n_all)[0]
    raise_errors_of([placed.value])
    return values


def placed_inputs(system: System, placed: PlacedLaw) -> Array:
    """Return the inputs of the law for assembled markers at rest, (n,)."""
    compiled = compiled_system(system)
    n_q = np.asarray(compiled.model.bodies.n_q)
    parts = [np.zeros(1)]
    for marker in placed.markers:
        r, A = marker_pose(marker, compiled.placed, n_q)
        parts += [r, A.ravel(), np.zeros(placed.head[1] - 12)]
    return np.concatenate([*parts, placed.law.start, np.zeros(len(placed.multipliers))])


def sample_inputs(system: System, placed: PlacedLaw, state: State | None) -> list[Array]:
    """Return the inputs of the law for each of the motions, (n,) each."""
    compiled = compiled_system(system)
    made = consistent_motion(system, state)
    work = new_work(compiled.model)
    set_iterate(work, made.state, made.u_dot, made.w)
    linearized(compiled.model, work, 1.0, 0.0, 0.0)
    first, n = int(compiled.model.connections.a[placed.connection]), len(placed.markers)
    own = [*placed.states, *placed.multipliers]
    rng, length = np.random.default_rng(7), compiled.length
    samples = []
    for k in range(N_SAMPLES):
        near, moving = (NEAR, MOVING) if k else (0.0, 0.0)
        parts = [np.zeros(1)]
        for m, marker in zip(range(first, first + n), placed.markers, strict=True):
            moves = float(marker.body >= 0)
            r, A, v, omega = (getattr(work.markers, name)[m] for name in ("r", "A", "v", "omega"))
            turn = rotation_exp(moves * near * rng.normal(size=3))
            parts += [
                r + moves * near * length * rng.normal(size=3), (turn @ A).ravel(),
                v + moves * moving * length * rng.normal(size=3), omega + moves * moving * rng.normal(size=3),
            ]  # fmt: skip
            if placed.law.accelerations:
                parts += [moves * moving * length * rng.normal(size=3), moves * moving * rng.normal(size=3)]
        parts.append(made.w[own] * (1 + near * rng.normal(size=len(own))))
        samples.append(np.concatenate(parts))
    return samples


def told_in_python(placed: PlacedLaw, inputs: Array, where: str) -> list[str]:
    """Return errors of the function called in Python, checks (1) and (2)."""
    law, n = placed.law, len(placed.markers)
    function = getattr(law.function, "py_func", law.function)
    results = []
    for _ in range(2):
        wrench, z_dot, g = np.zeros((n, 6)), np.zeros(len(law.states)), np.zeros(len(law.multipliers))
        width = placed.head[1]
        outputs, x = np.zeros(len(law.outputs)), inputs[1 : 1 + width * n].reshape(n, width).copy()
        z, lam = np.split(inputs[1 + width * n :].copy(), [len(law.states)])
        given = (x, z, lam, np.array(law.data))
        before = [each.copy() for each in given]
        try:
            with np.errstate(all="ignore"):
                function(float(inputs[0]), *given, wrench, z_dot, g, outputs)
        except Exception as error:
            sizes = f"wrench {wrench.shape}, z_dot {z_dot.shape}, g {g.shape}, outputs {outputs.shape}"
            return [
                f"{where}: its function raised {type(error).__name__}: {error} (with {sizes}, data {given[3].shape})"
            ]
        for name, old, new in zip(("x", "z", "lam", "data"), before, given, strict=True):
            if not np.array_equal(old, new):
                return [f"{where}: its function changes {name}, which is an input"]
        results.append(np.concatenate([wrench.ravel(), z_dot, g, outputs]))
    if not np.array_equal(results[0], results[1], equal_nan=True):
        return [f"{where}: two calls with the same numbers give different results; it must depend on them alone"]
    values = values_of(placed, inputs)
    scale = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    far = ~np.isclose(values, results[0], rtol=ROUNDING, atol=ROUNDING * scale, equal_nan=True)
    if far.any():
        k = int(np.flatnonzero(far)[0])
        return [f"{where}: {row_name(placed, k)}: {values[k]:.6g} compiled, but {results[0][k]:.6g} in Python"]
    return []


def balance(placed: PlacedLaw, values: Array, where: str) -> list[str]:
    """Return errors in the equilibrium of the wrenches, check (3)."""
    law, n = placed.law, len(placed.markers)
    wrench = values[: 6 * n].reshape(n, 6)
    found = []
    assert law.acts is not None  # ensured by the compilation of the element
    for m, (marker, acts) in enumerate(zip(placed.markers, law.acts, strict=True)):
        lost = [k for k in range(6) if k not in ACTS[acts] and wrench[m, k] != 0.0]
        if lost and marker.body >= 0:
            names = ", ".join(row_name(placed, 6 * m + k) for k in lost)
            found.append(f"{where}: {names}: written, but acts = {acts!r} excludes this, so that it has no effect")
    if law.is_opposite and not np.allclose(wrench[0, :3], -wrench[1, :3], rtol=ROUNDING, atol=0.0):
        forces = " and ".join(str(np.round(each, 6).tolist()) for each in wrench[:, :3])
        found.append(f"{where}: is_opposite says the forces on both markers are opposite, got {forces}")
    return found


def own_slopes(placed: PlacedLaw, inputs: Array) -> Array:
    """Return the derivatives that the engine uses, (n_out, n_columns)."""
    n_columns = placed.columns_of_marker * len(placed.markers) + len(placed.states) + len(placed.multipliers)
    address = placed.slopes.address
    data = np.concatenate([placed.law.data, placed.sizes])
    slopes = called_law(address, placed.head, data, inputs[None], placed.n_out * n_columns)
    raise_errors_of([placed.slopes])
    return without_ground(placed, slopes.reshape(placed.n_out, n_columns))


def differences(placed: PlacedLaw, inputs: Array) -> Array:
    """Return the same derivatives from finite differences; markers on the ground do not move."""
    slopes = difference_slopes(placed.value.address, placed.head, placed.law.data, inputs, placed.sizes)
    return without_ground(placed, slopes[: placed.n_out])


def without_ground(placed: PlacedLaw, slopes: Array) -> Array:
    """Return derivatives without columns of markers on the ground, which are not needed."""
    for m, marker in enumerate(placed.markers):
        if marker.body < 0:
            slopes[:, placed.columns_of_marker * m : placed.columns_of_marker * (m + 1)] = 0.0
    return slopes


def relative_error(n: int, own: Array, other: Array) -> Array:
    """Return differences of derivatives relative to the largest in the row, without those due to wrench roundoff."""
    scale = np.maximum(np.abs(own), np.abs(other)).max(axis=1, initial=0.0, keepdims=True)
    of_wrenches = scale[: 6 * n]
    of_wrenches[:] = np.maximum(of_wrenches, ROUNDING / DERIVATIVE * of_wrenches.max(initial=0.0))
    error = np.where(np.isfinite(own), np.abs(own - other), np.inf)
    return np.divide(error, scale, out=np.zeros_like(error), where=(error > 0) & np.isfinite(scale))


def wrong_slopes(placed: PlacedLaw, own: Array, other: Array, where: str) -> list[str]:
    """Return the derivative with the largest error if it is wrong, check (4)."""
    error = relative_error(len(placed.markers), own, other)
    error = np.where(np.isfinite(own), error, np.inf)
    if error.max(initial=0.0) <= DERIVATIVE:
        return []
    row, column = (int(k) for k in np.unravel_index(error.argmax(), error.shape))
    kind = "its tangent" if callable(placed.law.tangent) else f"tangent = {placed.law.tangent!r}"
    hint = "; at a kink of the law both may be right"
    if placed.law.tangent == "complex":
        hint += ", and compiled powers of complex numbers, v**2, lose the complex step: write v*v"
    return [
        f"{where}: derivative of {row_name(placed, row)} by {column_name(placed, column)}: {kind} gives "
        f"{own[row, column]:.6g}, differences {other[row, column]:.6g}{hint}"
    ]


def wrong_dependence(placed: PlacedLaw, slopes: Array, where: str) -> list[str]:
    """Return constraints that depend on forbidden quantities, check (5)."""
    found = []
    n, n_z, per = len(placed.markers), len(placed.states), placed.columns_of_marker
    for j, holds in enumerate(placed.law.holds):
        row = slopes[6 * n + n_z + j]
        allowed = np.zeros(len(row), dtype=bool)
        for m in range(n):
            allowed[per * m : per * m + {POSITION: 6, VELOCITY: 12}.get(holds, per)] = True
        if holds != POSITION:
            allowed[per * n : per * n + n_z] = True
        if not holds or not (np.abs(row[~allowed]) > DERIVATIVE * np.abs(row).max()).any():
            continue
        column = int(np.abs(np.where(allowed, 0.0, row)).argmax())
        what = (
            "a position, which may depend only on positions and time"
            if holds == POSITION
            else "a velocity, which may not depend on multipliers"
        )
        found.append(
            f"{where}: {row_name(placed, 6 * n + n_z + j)} depends on {column_name(placed, column)}, but constrains "
            f"{what}"
        )
    return found


def row_name(placed: PlacedLaw, k: int) -> str:
    """Return the name of output k of the law."""
    n, law = len(placed.markers), placed.law
    if k < 6 * n:
        return f"{'force' if k % 6 < 3 else 'moment'} {AXES[k % 3]} on marker {k // 6 + 1}"
    names = [*(f"rate of {name}" for name in law.states), *(f"g of {name}" for name in law.multipliers)]
    return [*names, *(f"output {name}" for name in law.outputs)][k - 6 * n]


def column_name(placed: PlacedLaw, k: int) -> str:
    """Return the name of input variation k."""
    n, law, per = len(placed.markers), placed.law, placed.columns_of_marker
    if k < per * n:
        kinds = ("position", "rotation", "velocity", "angular velocity", "acceleration", "angular acceleration")
        return f"{kinds[k % per // 3]} {AXES[k % 3]} of marker {k // per + 1}"
    return [*law.states, *law.multipliers][k - per * n]
