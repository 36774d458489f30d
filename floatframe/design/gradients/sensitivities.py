"""Derivatives of outputs of motions, equilibria and modes by parameters of a system."""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.analyses.linear.linearization import linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.design.gradients.differences import CENTRAL
from floatframe.design.gradients.discrete_motion import adjoint_gradient, computed_motion, direct_columns, start_columns
from floatframe.design.gradients.eigenvalues import (
    DEPENDS,
    Balance,
    SteadyRotation,
    branch_of,
    eigenvalue_derivatives,
    equilibrium_adjoint,
    equilibrium_columns,
    equilibrium_matrix,
    pencil_rates,
    steady_rotation_of,
    typical_displacements,
)
from floatframe.design.gradients.outputs import (
    Column,
    OutputRequest,
    Take,
    columns_of,
    moved,
    values_at,
    wanted_of,
    weights_of,
)
from floatframe.design.gradients.parameters import Family, Neighbour, Source, family_of, neighbour
from floatframe.design.gradients.tangents import Point, parameter_residuals, tangents_at
from floatframe.design.studies.study import OF_MODES
from floatframe.engine.compiling.file_frames import motion_of_engine
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.rows import structure_of
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.integrators.integrator import Integrator
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.forces import UserForce
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.simulation.events import events_of
from floatframe.simulation.integrate import number_of_steps
from floatframe.simulation.jumps import jumps_of_steps
from floatframe.simulation.switch_events import switch_events

__all__ = ["ANALYSES", "METHODS", "Sensitivities", "sensitivities"]

log = logging.getLogger(__name__)

ANALYSES = ("run", "static", "rotation", "modes")
METHODS = ("direct", "adjoint")
TOLERANCE = 1e-12  #: tolerance of Newton's method in the differentiated steps
SLOPE_STEP = 2e-4  #: step of differences of sensors, relative to the magnitude of the state


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Sensitivities(Tabular):
    """Values of outputs and their derivatives by parameters.

    Parameters
    ----------
    outputs
        Names of the outputs.
    parameters
        Names of the parameters.
    values
        Values of the outputs, (n_out,).
    gradient
        d output/d parameter, (n_out, n_p).
    units
        Units of the outputs.
    parameter_values
        Values of the parameters, (n_p,).
    repeated
        Outputs of modes whose eigenvalue is repeated: their derivatives are those of one branch, parameter by
        parameter, and do not add up for changes of several parameters.
    """

    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    values: Array
    gradient: Array
    units: tuple[str, ...]
    parameter_values: Array
    repeated: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("values", "gradient", "parameter_values"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=float)))

    def of(self, output: str, parameter: str) -> float:
        """Return one derivative by names; `ModelError` with the nearest name if it does not exist."""
        for name, choices in ((output, self.outputs), (parameter, self.parameters)):
            if name not in choices:
                raise ModelError(f"sensitivities: there is no {quoted(name)}{nearest(name, choices)}")
        return float(self.gradient[self.outputs.index(output), self.parameters.index(parameter)])

    is_indexed = False

    def to_table(self) -> Table:
        """Return one row per output and parameter."""
        rows = [
            (name, unit, value, parameter, at, slope)
            for name, unit, value, row in zip(self.outputs, self.units, self.values, self.gradient, strict=True)
            for parameter, at, slope in zip(self.parameters, self.parameter_values, row, strict=True)
        ]
        return Table.of_rows(("output", "unit", "value", "parameter", "at", "derivative"), rows)

    @property
    def relative(self) -> Array:
        """Relative derivatives (p/y) dy/dp of outputs y by parameters p, (n_out, n_p); NaN where y is zero."""
        y = np.where(self.values == 0, np.nan, self.values)
        return np.asarray(self.gradient * self.parameter_values / y[:, None])


def sensitivities(
    system: Source,
    outputs: Sequence[str] | Mapping[str, str | tuple[str, Take]],
    parameters: Sequence[str] | Mapping[str, Any],
    *,
    analysis: str = "run",
    method: str = "direct",
    t_end: float | None = None,
    h: float | None = None,
    integrator: Integrator | None = None,
    t_start: float = 0.0,
    state: State | None = None,
    steps: Mapping[str, float] | None = None,
    omega: Array | tuple[float, float, float] | None = None,
    center: Array | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Sensitivities:
    """Return outputs of a motion, an equilibrium or the modes about it, with their derivatives by parameters.

    Parameters
    ----------
    system
        A system; or the path of a system file; or a function that takes a dict of names and values and returns one.
    outputs
        Columns of sensors or joint coordinates, such as "tip x" or "hinge.angle value", of which the last value is
        taken. Or a dict from names to such columns, or to pairs of a column and its reduction over time: a name, as in
        studies ("rms"), or a function from the values, (n_t,), to a number and its derivatives, (n_t,).
        For "modes": "frequency 1", "damping 2", "real 1", "imaginary 3".
    parameters
        Key paths, "bodies.rod.mass" (docs/sensitivities.md), or a dict from names to them. Of a file: its keys, as in
        studies. Of a function: a dict from names to values.
    analysis
        "run", a motion by generalized-alpha; "static", the equilibrium at rest; "rotation", a steady rotation of the
        whole system; "modes", the modes about the equilibrium at rest.
    method
        "direct", whose cost grows with the parameters, or "adjoint", whose cost grows with the outputs.
    t_end, h, integrator, t_start, state
        Of a motion, as for `integrate`; the defaults for a file are in its table [run].
    steps
        Steps of finite differences by name of the parameter, if the default, a thousandth of its size, does not suit.
    omega, center
        Of "rotation": angular velocity and a point of the axis, ground axes, (3,) [rad/s, m].

    Raises
    ------
    ModelError, SystemFileError
        If a parameter or output does not exist, a parameter changes the topology, or the motion has events, jumps of
        forces, forces with states, or steps that are not those of generalized-alpha with fixed step.
    ConvergenceError
        If there is no motion or equilibrium.
    """
    if analysis not in ANALYSES:
        raise ModelError(f"sensitivities: no analysis {quoted(analysis)}{nearest(analysis, ANALYSES)}")
    if omega is not None and analysis != "rotation":
        raise ModelError('sensitivities: omega belongs to analysis = "rotation"')
    if method not in METHODS:
        raise ModelError(f"sensitivities: no method {quoted(method)}{nearest(method, METHODS)}")
    wanted = wanted_of(outputs)
    family = family_of(system, parameters, steps=steps)
    require_no_memory(family.system)
    own = neighbour(family.system)
    if analysis == "modes":
        return of_modes(family, own, wanted)
    columns = columns_of(family.system, wanted)
    if analysis == "static":
        return of_equilibrium(family, own, wanted, columns, method)
    if analysis == "rotation":
        if omega is None:
            raise ModelError("sensitivities: a steady rotation needs omega")
        spin = array_of_shape("sensitivities: omega", omega, (3,))
        if not spin.any():
            raise ModelError('sensitivities: omega: expected a rotation other than 0; take analysis = "static"')
        about = array_of_shape("sensitivities: center", center, (3,))
        return of_rotation(family, own, wanted, columns, method, steady_rotation_of(family, own, spin, about))
    if isinstance(system, str | os.PathLike):
        t_end, h, integrator = run_of_file(system, t_end, h, integrator)
    if t_end is None or h is None:
        raise ModelError("sensitivities: a motion needs t_end and h")
    scheme = required_scheme(GeneralizedAlpha() if integrator is None else integrator)
    t_start, t_end = number("sensitivities: t_start", t_start), number("sensitivities: t_end", t_end)
    h = number("sensitivities: h", h, above=0.0)
    if t_end <= t_start:
        raise ModelError(f"sensitivities: expected t_end above t_start = {t_start:g}, got {t_end:g}")
    n_steps = number_of_steps(t_start, t_end, h)
    require_smooth_run(family, t_start, (t_end - t_start) / n_steps, n_steps)
    times = t_start, (t_end - t_start) / n_steps, n_steps
    return of_motion(family, own, wanted, columns, method, scheme, times, state)


def run_of_file(path: Any, t_end: float | None, h: float | None, integrator: Integrator | None):
    """Return end, step and method of a run; missing values are taken from the file."""
    from floatframe.files.system_file.read_system import read_system
    from floatframe.files.system_file.run_section import required_run

    run = read_system(path)[1]
    if run is None:
        return t_end, h, integrator
    required_run(run, path)
    return t_end or run.t_end, h or run.h, integrator or run.integrator


def required_scheme(integrator: Integrator) -> GeneralizedAlpha:
    """Return the method with a tight tolerance; `ModelError` unless it is generalized-alpha with fixed steps."""
    if not isinstance(integrator, GeneralizedAlpha):
        raise ModelError(
            f"sensitivities: the steps of {type(integrator).__name__} are not differentiated; take GeneralizedAlpha, "
            "newmark, hht or trapezoidal"
        )
    if integrator.error_tolerance is not None or integrator.h_min is not None:
        raise ModelError(
            "sensitivities: steps that follow the motion (error_tolerance, h_min) jump with the parameters; take "
            "fixed steps"
        )
    return replace(integrator, tolerance=min(integrator.tolerance, TOLERANCE), stabilized=False)


def require_no_memory(system: System) -> None:
    """Raise `ModelError` if a force has states, which the derivatives do not include."""
    for force in system.forces:
        if isinstance(force, UserForce) and force.states:
            raise ModelError(
                f"sensitivities: force {force.name!r} has states, which are not differentiated; give its "
                "forces without states"
            )
    for each in compiled_system(system).laws:
        if each.law.accelerations:
            raise ModelError(
                f"sensitivities: element {each.element.name!r} uses accelerations, which are not differentiated; "
                "give its masses as bodies"
            )
        if each.law.states or each.law.multipliers:
            what = "states" if each.law.states else "multipliers"
            raise ModelError(
                f"sensitivities: element {each.element.name!r} has {what}, which are not differentiated; "
                "take an element without them, or vary its parameter by floatframe sweep"
            )
    compiled = compiled_system(system)
    if len(gaps := compiled.model.gaps.connection):
        raise ModelError(
            f"sensitivities: contact {compiled.connection_names[gaps[0]]!r} divides the step in which it closes, "
            "which is not differentiated; vary its parameter by floatframe sweep"
        )
    if len(rows := compiled.model.states.row):
        owner = int(np.searchsorted(compiled.model.connections.w0, rows[0], side="right")) - 1
        raise ModelError(
            f"sensitivities: {compiled.connection_names[owner]!r} has states of its own, which are not differentiated"
        )


def require_smooth_run(family: Family, t_start: float, h: float, n_steps: int) -> None:
    """Raise `ModelError` if the motion has events or jumps, at which integration restarts."""
    system = family.system
    acting = [event for event in events_of(system) if getattr(event, "is_active", True)]
    if acting:
        raise ModelError(
            f"sensitivities: event {acting[0].name!r}: motions over events are not differentiated; remove "
            "the events, or end the run before them"
        )
    stops = [coupler.name for coupler in system.couplers if coupler.limits is not None]
    if stops:
        raise ModelError(f"sensitivities: coupler {stops[0]!r} has limits: motions over impacts are not differentiated")
    if switches := switch_events(system):
        raise ModelError(
            f"sensitivities: {switches[0].name!r} is a switching function: motions over jumps are not differentiated"
        )
    if system.fmus:
        raise ModelError(f"sensitivities: unit {system.fmus[0].name!r} of another program is not differentiated")
    for each in (system, *(around.system for p in family.parameters for around in p.around)):
        jumps = [t for times in jumps_of_steps(each, t_start, h, n_steps).values() for t in times]
        if jumps:
            raise ModelError(
                f"sensitivities: a force jumps at t = {jumps[0]:.6g}, where the integration restarts; smooth it "
                "(smooth_step), or end the run before it"
            )


def of_motion(
    family: Family, own: Neighbour, wanted: tuple[OutputRequest, ...], columns: tuple[Column, ...], method: str,
    scheme: GeneralizedAlpha, times: tuple[float, float, int], state: State | None,
) -> Sensitivities:  # fmt: skip
    """Return the derivatives of a motion."""
    t_start, h, n_steps = times
    group, structure = Configurations(np.array(own.compiled.model.bodies.n_q)), structure_of(own.compiled.model)
    motion = computed_motion(family.system, scheme, t_start, h, n_steps, state)
    if all(each.take == "last" for each in wanted):
        series, units = values_at(own, columns, motion.points[-1:])
        series = np.vstack([np.zeros((n_steps, len(wanted))), series])
    else:
        series, units = values_at(own, columns, motion.points)
    require_columns_of_states(own, wanted, columns, motion.points)
    values = np.zeros(len(wanted))
    weights = np.zeros((n_steps + 1, len(wanted)))
    for j, each in enumerate(wanted):
        values[j], weights[:, j] = weights_of(each.take, series[:, j])
    at = [int(k) for k in np.flatnonzero(weights.any(axis=1))]
    S, shown = start_columns(family, group, own, motion, t_start, state)
    n_p = len(family.parameters)
    gradient, there = np.zeros((len(wanted), n_p)), [motion.points[k] for k in at]
    slopes_by_p = seen_otherwise(family, columns, there)
    if method == "direct":
        kept = direct_columns(family, structure, own, group, motion, S, shown, set(at))
        slopes_by_p += np.array([along(own, group, columns, motion.points[k], kept[k]) for k in at])
    else:
        slopes = {k: weighted_slopes(own, group, columns, motion.points[k], weights[k]) for k in at}
        if at:
            gradient += adjoint_gradient(family, structure, own, group, motion, S, shown, slopes)
    gradient += np.einsum("kj,kjp->jp", weights[at], slopes_by_p.reshape(len(at), len(wanted), n_p))
    return made(family, wanted, values, gradient, units)


def require_columns_of_states(
    own: Neighbour, wanted: tuple[OutputRequest, ...], columns: tuple[Column, ...], points: Sequence[Point]
) -> None:
    """Raise `ModelError` if a column, such as a spectrum, is not a function of the state at one time."""
    beside, alone = values_at(own, columns, points[-2:])[0][-1], values_at(own, columns, points[-1:])[0][0]
    for j, each in enumerate(wanted):
        if not abs(beside[j] - alone[j]) <= 1e-9 * max(abs(alone[j]), abs(beside[j])):
            raise ModelError(
                f"output {each.name!r}: {each.of!r} does not follow from the state at its time alone, and is not "
                "differentiated"
            )


def made(
    family: Family, wanted: tuple[OutputRequest, ...], values: Array, gradient: Array, units: list[str],
    repeated: tuple[str, ...] = (),
) -> Sensitivities:  # fmt: skip
    """Return the result with its names."""
    names = tuple(parameter.name for parameter in family.parameters)
    outputs = tuple(each.name for each in wanted)
    return Sensitivities(outputs, names, values, gradient, tuple(units), family.values, repeated)


def seen_otherwise(family: Family, columns: tuple[Column, ...], points: Sequence[Point]) -> Array:
    """Return the derivatives of measurements by parameters at fixed points, (n_points, n_out, n_p).

    Parameters may move the markers of sensors, and the frames of body files.
    """
    found = [p.derivative([values_at(each, columns, points)[0] for each in p.around]) for p in family.parameters]
    return np.moveaxis(np.array(found), 0, -1)


def along(own: Neighbour, group: Configurations, columns: tuple[Column, ...], point: Point, changes: Array) -> Array:
    """Return the derivatives of measurements, (n_out, n_p), along changes of the point by parameters.

    changes: d(x, u, u_dot, w)/dp, (3 n_u + n_w, n_p); the step along each moves the point by `SLOPE_STEP`.
    """
    size = np.abs(changes / scales_at(own, group, point)[:, None]).max(axis=0, initial=0.0)
    steps = SLOPE_STEP / np.where(size > 0, size, 1.0)
    places = [
        moved(group, own.compiled, point, change, offset * step)
        for change, step in zip(changes.T, steps, strict=True)
        for offset in CENTRAL.offsets
    ]
    values = values_at(own, columns, places)[0].reshape(len(steps), len(CENTRAL.offsets), len(columns))
    return np.asarray(np.einsum("s,ksj->jk", CENTRAL.weights, values) / steps)


def weighted_slopes(
    own: Neighbour, group: Configurations, columns: tuple[Column, ...], point: Point, weights: Array
) -> Array:
    """Return `slopes_at` times weights, (n_out, 3 n_u + n_w), for the columns with nonzero weight."""
    result = np.zeros((len(columns), 3 * group.n_v + len(point.w)))
    used = np.flatnonzero(weights)
    result[used] = weights[used, None] * slopes_at(own, group, tuple(columns[j] for j in used), point)
    return result


def slopes_at(own: Neighbour, group: Configurations, columns: tuple[Column, ...], point: Point) -> Array:
    """Return the derivatives of measurements by (x, u, u_dot, w) at a point, (n_out, 3 n_u + n_w)."""
    scale = scales_at(own, group, point)
    return along(own, group, columns, point, np.diag(scale)) / scale


def scales_at(own: Neighbour, group: Configurations, point: Point) -> Array:
    """Return typical magnitudes of (x, u, u_dot, w) at a point, (3 n_u + n_w,); a thousandth is a small change.

    (1) x: the length of the system, a radian, and `modal_size`. (2) u, u_dot: x times the rate of the fastest motion,
    and times its square. (3) w: wrenches that do as much work on x as the largest one; states: their own values.
    """
    x = np.ones(group.n_v)
    for _, j, n_q in group.parts():
        x[j : j + 3] = own.compiled.length
        x[j + 6 : j + 6 + n_q] = modal_size(own, point)
    rate, bend = np.abs(point.state.u / x).max(initial=0.0), np.abs(point.u_dot / x).max(initial=0.0)
    rate = rate or np.sqrt(bend) or 1.0
    set_iterate(own.work, point.state, point.u_dot, point.w)
    own.work.state.time[...] = point.t
    lever = abs(linearized(own.compiled.model, own.work, 1.0, 0.0, 0.0).J) @ x
    largest = np.abs(point.w * lever).max(initial=0.0)
    acts = lever > 0
    w = np.where(acts, (largest or 1.0) / np.where(acts, lever, 1.0), np.where(point.w != 0, np.abs(point.w), 1.0))
    return np.concatenate([x, rate * x, max(rate**2, bend) * x, w])


def modal_size(own: Neighbour, point: Point) -> float:
    """Return a typical modal coordinate, which moves markers by 1 % of the system, or the present one if larger."""
    psi = float(np.abs(own.compiled.model.markers.psi).max(initial=0.0))
    size = 0.01 * own.compiled.length / psi if psi > 0 else 1.0
    return max(size, float(np.abs(point.state.q).max(initial=0.0)))


def of_equilibrium(
    family: Family, own: Neighbour, wanted: tuple[OutputRequest, ...], columns: tuple[Column, ...], method: str
) -> Sensitivities:
    """Return the derivatives of the equilibrium at rest."""
    point, group, matrix, by_p = balanced(family, own)
    values, units = values_at(own, columns, [point])
    n = group.n_v
    gradient = seen_otherwise(family, columns, [point])[0]
    if method == "direct":
        change = equilibrium_columns(matrix, by_p)
        whole = np.vstack([change[:n], np.zeros((2 * n, change.shape[1])), change[n:]])
        gradient += along(own, group, columns, point, whole)
    else:
        slopes = slopes_at(own, group, columns, point)
        gradient += equilibrium_adjoint(matrix, np.hstack([slopes[:, :n], slopes[:, 3 * n :]]), by_p)
    return made(family, wanted, values[0], gradient, units)


def of_rotation(
    family: Family, own: Neighbour, wanted: tuple[OutputRequest, ...], columns: tuple[Column, ...], method: str,
    steady: SteadyRotation,
) -> Sensitivities:  # fmt: skip
    """Return the derivatives of a steady rotation; `ModelError` if an output depends on the angle of rotation."""
    values, units = values_at(own, columns, [steady.point])
    turned = along(own, steady.group, columns, steady.point, steady.whole(steady.turn[:, None]))[:, 0]
    for each, value, slope in zip(wanted, values[0], turned, strict=True):
        if steady.turn.any() and abs(slope) > DEPENDS * max(abs(float(value)), np.abs(values[0]).max(initial=0.0)):
            raise ModelError(
                f"output {each.name!r}: {each.of!r} changes as the system rotates ({slope:.3g} per radian), so that "
                "its value is not unique; take a joint coordinate, a distance, a magnitude, or rotating axes"
            )
    gradient = seen_otherwise(family, columns, [steady.point])[0]
    if method == "direct":
        gradient += along(own, steady.group, columns, steady.point, steady.whole(steady.columns()))
    else:
        gradient += steady.adjoint(slopes_at(own, steady.group, columns, steady.point))
    return made(family, wanted, values[0], gradient, units)


def balanced(family: Family, own: Neighbour) -> tuple[Point, Configurations, Balance, Array]:
    """Return the equilibrium at rest, its matrix, and the derivatives of the equations by the parameters."""
    rest = static_equilibrium(family.system, tolerance=1e-12)
    state, u_dot = motion_of_engine(own.compiled, rest.state, rest.u_dot)
    point, model = Point(0.0, state, u_dot, rest.w), own.compiled.model
    at = tangents_at(structure_of(model), model, own.work, point)
    matrix = equilibrium_matrix(at, own.compiled, family.system.name)
    return point, Configurations(np.array(model.bodies.n_q)), matrix, parameter_residuals(family.parameters, [point])[0]


def of_modes(family: Family, own: Neighbour, wanted: tuple[OutputRequest, ...]) -> Sensitivities:
    """Return the derivatives of frequencies, damping ratios and eigenvalues about the equilibrium at rest."""
    point, group, matrix, by_p = balanced(family, own)
    changes = equilibrium_columns(matrix, by_p)
    model = own.compiled.model
    at = tangents_at(structure_of(model), model, own.work, point)
    rates = [
        pencil_rates(parameter, own, group, point, change)
        for parameter, change in zip(family.parameters, changes.T, strict=True)
    ]
    modes = system_modes(linearize(family.system, static_equilibrium(family.system, tolerance=1e-12)))
    per_second = 1 / family.system.units.time
    values, gradient, units, repeated = [], [], [], []
    for each in wanted:
        part, k = part_and_mode(each, len(modes.eigenvalues))
        branch = branch_of(modes.eigenvalues, k - 1)
        if branch.n_times > 1:
            repeated.append(each.name)
            log.warning(
                "sensitivities: mode %d is one of %d with the same eigenvalue: derivatives are those of one branch, "
                "for each parameter alone, and do not add up", k, branch.n_times,
            )  # fmt: skip
        slopes = eigenvalue_derivatives(at, rates, branch, typical_displacements(own.compiled))
        value, slope = of_eigenvalue(part, branch.value, slopes, per_second)
        values.append(value)
        gradient.append(slope)
        units.append(OF_MODES[part])
    return made(family, wanted, np.array(values), np.array(gradient), units, tuple(repeated))


def part_and_mode(wanted: OutputRequest, n_modes: int) -> tuple[str, int]:
    """Return the quantity and the mode of an output."""
    part, _, digits = wanted.of.partition(" ")
    if part not in OF_MODES or not digits.isdigit() or int(digits) < 1:
        raise ModelError(
            f"output {wanted.name!r}: of = {wanted.of!r}: expected one of {', '.join(OF_MODES)} and the number of a "
            'mode, such as "frequency 1"'
        )
    if int(digits) > n_modes:
        raise ModelError(f"output {wanted.name!r}: of = {wanted.of!r}: the system has {n_modes} modes")
    return part, int(digits)


def of_eigenvalue(part: str, value: complex, by_p: Array, per_second: float) -> tuple[float, Array]:
    """Return a quantity of an eigenvalue and its derivatives, with the definitions of `system_modes` and studies."""
    if part == "real":
        return value.real * per_second, by_p.real * per_second
    if part == "imaginary":
        return value.imag * per_second, by_p.imag * per_second
    if part == "frequency":
        sign = np.sign(value.imag) or 1.0
        return abs(value.imag) / (2 * np.pi) * per_second, sign * by_p.imag / (2 * np.pi) * per_second
    size = abs(value)
    size_rate = (value.conjugate() * by_p).real / size
    return -value.real / size, -by_p.real / size + value.real * size_rate / size**2
