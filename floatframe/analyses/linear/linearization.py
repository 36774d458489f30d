"""Linearisation of a system about an equilibrium or steady motion, in coordinates that satisfy the joints.

With N a basis of the motions allowed by the joints (G N = 0), and the matrices of `tangents`:

    xi = N z,  nu = N z_dot + Omega N z
    M_z = Nᵀ M N,  C_z = Nᵀ (C N + M (Omega + Omega') N),  K_z = Nᵀ (K + C Omega + M Omega' Omega) N

N is constant in time, because nothing changes in axes that rotate with the system; `steadiness` ensures this. Velocity
constraints remove some of the motions, see `held_velocities`. Inputs s are forces, or move constraints, G Y + E = 0.
Then xi = N z + Y s, where Y needs no additional force (the quasi-static shape) if K_z is regular:

    M_z z'' + C_z z' + K_z z = B s + B_rate s' + B_acceleration s''
    y = L z + L_rate z' + L_acceleration z'' + D s + D_rate s' + D_acceleration s''

Outputs also depend on wrenches, which follow from z and s (`system_matrices`). States of elements and user forces
follow the motions in z. Their equations are of first order, with ones in C and zeros in M.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import Takes, checked_fields
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.analyses.linear.channels import (
    AnyInput,
    AnyOutput,
    channel_unit,
    inputs_of,
    named_input,
    named_output,
    observed,
    outputs_of,
    require_input,
)
from floatframe.analyses.linear.held_velocities import Rolling, rolled, rolling
from floatframe.analyses.linear.inputs import (
    BaseMotion,
    DriveMotion,
    base_columns,
    input_columns,
    input_rate,
    interface_forces,
)
from floatframe.analyses.relative.coordinate_basis import MODE, coordinate_basis, dependent_coordinates
from floatframe.analyses.snapshot import Equilibrium, snapshot
from floatframe.analyses.steady.steadiness import require_steady
from floatframe.analyses.system_matrices import ROUNDING, Inputs, Tangents, settled, tangents, turning_matrices
from floatframe.engine.compiling.file_frames import motion_of_engine, small_motions_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.tree.formulation import is_relative
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.forces import UserForce
from floatframe.model.system import Named, System
from floatframe.results.sensors.measurement import unit_words
from floatframe.results.small_motions.joint_rates import coordinate_rows
from floatframe.results.small_motions.rows import Rows, joined
from floatframe.results.small_motions.small_motions import BaseColumn, SmallMotions

if TYPE_CHECKING:
    from scipy.signal import StateSpace

__all__ = ["LinearSystem", "NamedMotions", "linearize"]

RANK = 1e-10  #: singular value of the scaled rows below which a row is redundant
NOISE = 1e-10  #: component, relative to the largest component of a motion, below which it is a rounding error
#: joint motion, relative to the largest motion of a body, below which the joint coordinate is a state of last choice
FAINT = 1e-6
#: largest distance of an element state from rest, or change per unit of time, relative to its size, in a steady motion
STEADY = 1e-6
TINY = float(np.finfo(float).tiny)
MASSLESS = 1e-12  #: eigenvalue of the scaled mass matrix below which a motion has no mass


@dataclass(frozen=True, eq=False)
class NamedMotions:
    """Named motions, as rows for the independent motions z."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array  #: coefficients of the named motions, (n_names, n_z)
    #: kind: 0 joint coordinates, 1 modal coordinates, 2 body frame motions, 3 joint coordinates that hardly move
    ranks: tuple[int, ...]
    time_unit: str


def empty() -> Array:
    """Return a placeholder for a zero matrix whose size is not yet known."""
    return np.zeros((0, 0))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LinearSystem:
    """Linear equations for small motions z about a steady motion, with n_s inputs s and outputs y.

    M z'' + C z' + K z = B s + B_rate s' + B_acceleration s''
    y = L z + L_rate z' + L_acceleration z'' + D s + D_rate s' + D_acceleration s''

    Parameters
    ----------
    equilibrium
        The steady motion.
    M, C, K
        Mass, damping and stiffness, (n_z, n_z). C includes gyroscopic terms; K includes geometric, centrifugal and
        circulatory terms.
    B, B_rate, B_acceleration
        Forces per input and its rates, (n_z, n_s).
    L, L_rate, L_acceleration
        Outputs per z and its rates, (n_outputs, n_z).
    D, D_rate, D_acceleration
        Outputs per input and its rates, (n_outputs, n_s).
    N
        Motions of the bodies (translation and rotation in body axes, modes) per z, (n_u, n_z).
    Y
        Motions of the bodies per s, in addition to those of z, (n_u, n_s).
    inputs
        Names of the inputs s, (n_s,).
    input_units
        Unit of each input.
    input_rates
        r, if the input is the r-th derivative of s; 0 for forces.
    outputs
        Names of the outputs y, (n_outputs,).
    output_units
        Unit of each output.
    output_values
        Outputs in the steady motion, (n_outputs,).
    left_out
        Columns of outputs that are not linear here, with the reasons.
    body_names
        Names of the bodies.
    body_masses
        Mass matrix of each body, (6 + n_q, 6 + n_q).
    motions
        Motions that can become states, see `state_space`.
    states
        Names of the last entries of z: displacements along velocity constraints, and states of elements and user
        forces. Their rows of C are those of a unit matrix, and their rows of M depend only on z''.
    state_units
        Unit of each state.
    coordinates
        Names of z, for relative coordinates without velocity constraints; else empty.
    """

    equilibrium: Equilibrium
    M: Array
    C: Array
    K: Array
    B: Array
    L: Array
    N: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    body_names: tuple[str, ...]
    body_masses: tuple[Array, ...]
    B_rate: Array = field(default_factory=empty)
    B_acceleration: Array = field(default_factory=empty)
    L_rate: Array = field(default_factory=empty)
    L_acceleration: Array = field(default_factory=empty)
    D: Array = field(default_factory=empty)
    D_rate: Array = field(default_factory=empty)
    D_acceleration: Array = field(default_factory=empty)
    Y: Array = field(default_factory=empty)
    input_rates: tuple[int, ...] = ()
    input_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    output_values: Array = field(default_factory=empty)
    left_out: Mapping[str, str] = field(default_factory=dict)
    motions: NamedMotions | None = None
    states: tuple[str, ...] = ()
    state_units: tuple[str, ...] = ()
    coordinates: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n_z, n_s, n_y = self.M.shape[0], len(self.inputs), len(self.outputs)
        shapes: dict[str, tuple[int, ...]] = {"B": (n_z, n_s), "L": (n_y, n_z), "D": (n_y, n_s)}
        shapes |= {"Y": (self.N.shape[0], n_s), "output_values": (n_y,)}
        for name in ("M", "C", "K", "N", *COEFFICIENTS, "Y", "output_values"):
            array = np.asarray(getattr(self, name), dtype=float)
            if not array.size and name not in ("M", "C", "K", "N"):
                array = np.zeros(shapes[name.split("_")[0] if name in COEFFICIENTS else name])
            object.__setattr__(self, name, frozen(array))
        if not self.input_rates:
            object.__setattr__(self, "input_rates", (0,) * n_s)

    @property
    def n_z(self) -> int:
        """Number of independent motions (mobility including modes), without states."""
        return int(self.M.shape[0]) - len(self.states)

    def bodies(self) -> Iterator[tuple[slice, Array]]:
        """Yield the rows of N and the mass matrix for each body."""
        first = 0
        for mass in self.body_masses:
            yield slice(first, first + len(mass)), mass
            first += len(mass)

    def with_mass(self) -> tuple["LinearSystem", Array]:
        """Return the system without massless motions, and T in z = T z_new.

        Massless motions follow the other motions statically. The direct effect of inputs on outputs through them is
        added to D, D_rate and D_acceleration. Third rates of inputs, and damping along massless motions, are neglected.
        """
        dynamic, static = self.motions_with_and_without_mass()
        if not static.shape[1]:
            return self, np.eye(len(self.M))
        K_s = static.T @ self.K @ static
        T = dynamic - static @ la.solve(K_s, static.T @ self.K @ dynamic)
        parts = {name: T.T @ getattr(self, name) @ T for name in ("M", "C", "K")}
        parts |= {name: T.T @ getattr(self, name) for name in ("B", "B_rate", "B_acceleration")}
        parts |= {name: getattr(self, name) @ T for name in ("L", "L_rate", "L_acceleration", "N")}
        by_input = [static @ la.solve(K_s, static.T @ B) for B in (self.B, self.B_rate, self.B_acceleration)]
        parts["D"] = self.D + self.L @ by_input[0]
        parts["D_rate"] = self.D_rate + self.L @ by_input[1] + self.L_rate @ by_input[0]
        parts["D_acceleration"] = (
            self.D_acceleration + self.L @ by_input[2] + self.L_rate @ by_input[1] + self.L_acceleration @ by_input[0]
        )
        motions = None if self.motions is None else replace(self.motions, rows=self.motions.rows @ T)
        return replace(self, **parts, Y=self.Y + self.N @ by_input[0], motions=motions, coordinates=()), T

    def motions_with_and_without_mass(self) -> tuple[Array, Array]:
        """Return bases of z: motions with mass (orthonormal in mass) and states, then massless motions."""
        n, n_states = self.n_z, len(self.states)
        dynamic, static = massive_and_massless(self.M[:n, :n])
        return la.block_diag(dynamic, np.eye(n_states)), np.pad(static, ((0, n_states), (0, 0)))

    def feedthrough(self) -> Array:
        """Return the direct effect of inputs on outputs, D of the state space, (n_outputs, n_inputs).

        Velocities of massless motions would be derivatives of the inputs, which a state space cannot contain; they are
        neglected.
        """
        return np.asarray(self.state_space().D)

    def kept_inputs(self) -> list[tuple[int, int]]:
        """Return (input, r) for each derivative of s that a state space needs as a state."""
        return [(k, r) for k, rate in enumerate(self.input_rates) for r in range(rate) if self.sees_input(k, rate - 1)]

    def sees_input(self, k: int, most: int) -> bool:
        """Return whether the equations contain a derivative of input k of order 0 to `most`; False if most < 0."""
        parts = [(self.B, self.D), (self.B_rate, self.D_rate), (self.B_acceleration, self.D_acceleration)]
        return any(part[:, k].any() for pair in parts[: most + 1] for part in pair)

    def state_space(self) -> "StateSpace":
        """Return A, B, C, D for z and z_dot of motions with mass, then element states, as `scipy.signal.StateSpace`.

        An input that is a velocity or acceleration adds its integrals as states (see `kept_inputs`), if the equations
        depend on them.

        Raises
        ------
        ModelError
            If an input is a displacement or velocity, and the motion depends on its derivatives.
        """
        from scipy.signal import StateSpace

        system, _ = self.with_mass()
        system.require_states()
        n, n_s, kept, m = system.n_z, len(system.inputs), system.kept_inputs(), len(system.states)
        factor = la.cho_factor(system.M[:n, :n])
        n_x = 2 * n + m + len(kept)
        # s, s', s'' as functions of the state x and the inputs u
        by_x, by_u = np.zeros((3, n_s, n_x)), np.zeros((3, n_s, n_s))
        for k, rate in enumerate(system.input_rates):
            by_u[rate, k, k] = 1.0
        for j, (k, r) in enumerate(kept):
            by_x[r, k, 2 * n + m + j] = 1.0
        of_all = (system.B, system.B_rate, system.B_acceleration)
        of_s = [la.cho_solve(factor, B[:n]) for B in of_all]
        A, B = np.zeros((n_x, n_x)), np.zeros((n_x, n_s))
        moved, last = slice(n, 2 * n), slice(2 * n, 2 * n + m)
        A[:n, moved] = np.eye(n)
        A[moved, :n] = -la.cho_solve(factor, system.K[:n, :n])
        A[moved, moved] = -la.cho_solve(factor, system.C[:n, :n])
        A[moved, last] = -la.cho_solve(factor, system.K[:n, n:])
        A[moved] += sum(b @ x for b, x in zip(of_s, by_x, strict=True))
        B[moved] = sum(b @ u for b, u in zip(of_s, by_u, strict=True))
        A[last, :n], A[last, moved], A[last, last] = -system.K[n:, :n], -system.C[n:, :n], -system.K[n:, n:]
        A[last] += sum(b[n:] @ x for b, x in zip(of_all, by_x, strict=True)) - system.M[n:, :n] @ A[moved]
        B[last] = sum(b[n:] @ u for b, u in zip(of_all, by_u, strict=True)) - system.M[n:, :n] @ B[moved]
        for j, (k, r) in enumerate(kept):
            above = r + 1
            A[2 * n + m + j], B[2 * n + m + j] = by_x[above, k], by_u[above, k]
        none = np.zeros((len(system.outputs), len(kept)))
        C = np.hstack([system.L[:, :n], system.L_rate[:, :n], system.L[:, n:], none])
        C += system.L_acceleration[:, :n] @ A[moved]
        D = system.L_acceleration[:, :n] @ B[moved]
        for part, x, u in zip((system.D, system.D_rate, system.D_acceleration), by_x, by_u, strict=True):
            C, D = C + part @ x, D + part @ u
        return StateSpace(A, B, C, D)

    def require_states(self) -> None:
        """Raise `ModelError` if the equations need a derivative of a prescribed motion that is an input."""
        for k, rate in enumerate(self.input_rates):
            above = (self.B_rate, self.B_acceleration)[rate:] if rate < 2 else ()
            is_force = rate == 0 and not self.Y[:, k].any()
            if not is_force and any(part[:, k].any() for part in above):
                raise ModelError(
                    f"state space: input {self.inputs[k]!r} is a {('displacement', 'velocity')[rate]}, but inertia or "
                    "damping needs its derivatives; give it as an acceleration (rate = 2), or compute the "
                    "frequency response"
                )

    def response(self, frequencies: Array) -> Array:
        """Return the complex frequency response y/s, (n_frequencies, n_outputs, n_inputs), at frequencies [Hz].

        At frequency zero, a constant velocity or acceleration has an unlimited displacement; the response is infinite
        if an output depends on it.
        """
        H = np.empty((len(frequencies), len(self.outputs), len(self.inputs)), complex)
        rates = np.array(self.input_rates, dtype=int)
        for k, omega in enumerate(2 * np.pi * np.asarray(frequencies, dtype=float)):
            s = 1j * omega
            if omega == 0 and rates.any():
                H[k] = self.response_at_rest()
                continue
            try:
                z = np.linalg.solve(
                    self.K + s * self.C + s**2 * self.M, self.B + s * self.B_rate + s**2 * self.B_acceleration
                )
                H[k] = (self.L + s * self.L_rate + s**2 * self.L_acceleration) @ z
                H[k] += self.D + s * self.D_rate + s**2 * self.D_acceleration
            except np.linalg.LinAlgError:  # an undamped resonance exactly at this frequency
                H[k] = np.inf
            if rates.any():
                H[k] /= s**rates
        return H

    def response_at_rest(self) -> Array:
        """Return the response at frequency zero for rate inputs: the coefficient of s^r in the series of y."""
        by_order: list[Array] = []
        z: list[Array] = []
        for order, (B, D) in enumerate(zip((self.B, self.B_rate, self.B_acceleration),
                                           (self.D, self.D_rate, self.D_acceleration), strict=True)):  # fmt: skip
            load = B.copy()
            if order > 0:
                load = load - self.C @ z[order - 1]
            if order > 1:
                load = load - self.M @ z[order - 2]
            try:
                z.append(np.asarray(np.linalg.solve(self.K, load), dtype=float))
            except np.linalg.LinAlgError:
                return np.full((len(self.outputs), len(self.inputs)), np.inf, complex)
            rows = (self.L, self.L_rate, self.L_acceleration)
            terms = [(rows[i], z[order - i]) for i in range(order + 1)]
            by_order.append(settled(D + sum(L @ x for L, x in terms), *terms, (np.eye(len(D)), D)))
        H = np.empty((len(self.outputs), len(self.inputs)), complex)
        for k, rate in enumerate(self.input_rates):
            H[:, k] = by_order[rate][:, k]
            H[np.any([order[:, k] != 0 for order in by_order[:rate]], axis=0), k] = np.inf
        return H


COEFFICIENTS = ("B", "B_rate", "B_acceleration", "L", "L_rate", "L_acceleration", "D", "D_rate", "D_acceleration")


def linearize(
    system: System,
    about: Equilibrium | None = None,
    *,
    inputs: Annotated[Sequence[AnyInput | str] | None, Takes(Sequence[Named | str] | None)] = None,
    outputs: Sequence[AnyOutput | str] | None = None,
    formulation: str = "absolute",
) -> LinearSystem:
    """Linearise a system about an equilibrium, a steady rotation or a steady running motion.

    Parameters
    ----------
    system
        The system.
    about
        Result of `static_equilibrium`, `steady_rotation` or `steady_motion`; by default the equilibrium at rest.
    inputs
        Names, such as "motor.torque" (a force), "hub.angle" (the force along it) or "jib/tip:z"; or channels (forces
        along them), `DriveMotion`, `BaseMotion`, `ParameterInput`. None: those of the system.
    outputs
        Names, such as "pin.angle", "tip.x" or "tip" (one output for each linear column, see `LinearSystem.left_out`);
        or sensors, their columns (`Column`) and channels. Directions rotate with a steady rotation. None: those of the
        system.
    formulation
        "relative": z are the coordinates of the joints of the tree and the modes, without those that close loops; their
        names are `LinearSystem.coordinates`. "absolute": z are any independent motions.

    Raises
    ------
    ModelError
        If there is no such formulation, nothing can move, the state moves but is not steady, a channel refers to a
        point that does not exist, or a requested column is not linear here.
    """
    inputs = tuple(named_input(system, each) for each in (inputs_of(system.inputs) if inputs is None else inputs))
    outputs = tuple(named_output(system, each) for each in (outputs_of(system.outputs) if outputs is None else outputs))
    for channel in inputs:
        require_input(channel)
    about = static_equilibrium(system, formulation=formulation) if about is None else about
    compiled = compiled_system(system)
    model, work = compiled.model, new_work(compiled.model)
    work.state.time[...] = about.t
    state, u_dot = motion_of_engine(compiled, about.state, about.u_dot)
    set_iterate(work, state, u_dot, about.w)
    shown = small_motions_of_file(compiled, state.q)
    parts = tangents(model, work)
    require_slow_states(compiled)
    states = states_of(system, compiled, work, parts)
    n_states = len(states.names)
    now = snapshot(system, about)
    bases = (*base_columns(system, inputs), *(BaseColumn() for _ in states.names))
    forces = (*interface_forces(system, now, inputs), *(() for _ in states.names))
    small = SmallMotions(system, compiled, work, state, about.omega, now, bases, forces)
    by_inputs = input_columns(small, inputs).beside(parts.by_states)
    Omega, Omega_t = turning_matrices(model, work, about.omega)
    basis = coordinate_basis(system, state, parts.G, shown) if is_relative(formulation) else None
    N = allowed_motions(system, parts.G) if basis is None else basis.N
    if N.shape[1] == 0:
        raise ModelError(f"system {system.name!r}: its joints and drives allow no motion; nothing can be linearised")
    roll = rolling(parts, Omega, N, by_inputs)
    require_steady(compiled, about, work, parts, N, np.eye(N.shape[1]) if roll is None else roll.S)
    D_0, D_1, D_2 = parts.full(Omega, Omega_t)
    K_z, C_z, M_z = (settled(N.T @ D @ N, (N.T, np.abs(D) @ np.abs(N)), error=ROUNDING) for D in (D_0, D_1, D_2))
    force, force_rate = parts.body_forces(by_inputs)
    moves = np.array([*(isinstance(channel, DriveMotion | BaseMotion) for channel in inputs), *[False] * n_states])
    Y, size = motions_of_inputs(small, parts, by_inputs, N, K_z, D_0, moves)
    seen = observed(small, outputs)
    rows = joined([seen.rows, rates_of_states(small, parts, Omega)])
    w = parts.wrenches(by_inputs, Omega, Omega_t) if rows.w.any() else None
    of_motions = [rows.x[:, : small.n_u], rows.v[:, : small.n_u], rows.a[:, : small.n_u]]
    of_inputs = [rows.x[:, small.n_u :], rows.v[:, small.n_u :], rows.a[:, small.n_u :]]
    if w is not None:
        of_motions = [own + rows.w @ part for own, part in zip(of_motions, (w.x, w.v, w.a), strict=True)]
        of_inputs[0], of_inputs[1] = of_inputs[0] + rows.w @ w.s, of_inputs[1] + rows.w @ w.s_rate
    by_bodies = la.block_diag(*shown) @ N
    one = np.eye(len(rows))
    coefficients = {
        "B": without_rounding(N, force, D_0, Y, size),
        "B_rate": without_rounding(N, force_rate, D_1, Y, size),
        "B_acceleration": -N.T @ (D_2 @ Y),
        "L": of_motions[0] @ N,
        "L_rate": of_motions[1] @ N,
        "L_acceleration": of_motions[2] @ N,
        "D": settled(of_inputs[0] + of_motions[0] @ Y, (of_motions[0], size), (one, of_inputs[0])),
        "D_rate": settled(of_inputs[1] + of_motions[1] @ Y, (of_motions[1], size), (one, of_inputs[1])),
        "D_acceleration": settled(of_inputs[2] + of_motions[2] @ Y, (of_motions[2], size), (one, of_inputs[2])),
    }
    matrices = {"M": M_z, "C": C_z, "K": K_z, **coefficients, "N": by_bodies}
    matrices = with_states(matrices, n_states)
    if basis is None:
        motions = named_motions(system, by_bodies, coordinate_rows(system, compiled, work, state), N, n_states)
    else:
        rows_of_z = np.eye(len(basis.names), len(basis.names) + n_states)
        ranks = (0,) * len(basis.names)
        motions = NamedMotions(basis.names, basis.units, rows_of_z, ranks, system.units.time_symbol)
    if roll is not None:
        matrices, states = rolled(matrices, roll, n_states), states.behind(roll, system.units.length_symbol)
        motions = replace(motions, rows=motions.rows @ roll.places(n_states))
    return LinearSystem(
        about,
        **matrices,
        Y=(la.block_diag(*shown) @ Y)[:, : len(inputs)],
        inputs=tuple(channel.name for channel in inputs),
        outputs=seen.names,
        body_names=compiled.body_names,
        body_masses=tuple(
            seen_from(T, mass) for T, mass in zip(shown, linearized(model, work, 1.0, 0.0, 0.0).H, strict=True)
        ),
        input_rates=tuple(input_rate(channel) for channel in inputs),
        input_units=tuple(channel_unit(system, channel) for channel in inputs),
        output_units=seen.units,
        output_values=seen.values,
        left_out=seen.left_out,
        motions=motions,
        states=states.names,
        state_units=states.units,
        coordinates=basis.names if basis is not None and roll is None else (),
    )


@dataclass(frozen=True, eq=False)
class NamedStates:
    """States of elements and user forces in order."""

    names: tuple[str, ...]
    units: tuple[str, ...]

    def behind(self, roll: Rolling, unit: str) -> "NamedStates":
        """Return these states preceded by displacements along velocity constraints (`eta` of `held_velocities`)."""
        n = len(roll.by_eta)
        return NamedStates((*(f"rolled way {k + 1}" for k in range(n)), *self.names), (*(unit,) * n, *self.units))


def require_slow_states(compiled: CompiledSystem) -> None:
    """Raise `ModelError` if rates of element states may depend on accelerations, which would change M."""
    for each in compiled.laws:
        if each.law.accelerations and each.law.states:
            raise ModelError(
                f"linearize: element {each.element.name!r} has states and uses accelerations, which small motions do "
                "not support; move its states to an element that uses only velocities"
            )


def states_of(system: System, compiled: CompiledSystem, work: Work, parts: Tangents) -> NamedStates:
    """Return the states of user forces and elements; `ModelError` if a state is not at rest."""
    found = [
        (f"{force.name}.{name}", "") for force in system.forces if isinstance(force, UserForce) for name in force.states
    ]
    for each in compiled.laws:
        units = zip(each.law.states, each.law.state_units, strict=True)
        found += [(f"{each.element.name}.{name}", unit) for name, unit in units]
    rows, size = compiled.model.states.row, compiled.model.states.size
    for (name, _), row, least in zip(found, rows, size, strict=True):
        value, rate = work.state.w[row], -work.connections.g[row + 1] + work.state.w[row + 1]
        if abs(rate) > STEADY * max(abs(value), least) * (1 + abs(parts.V[row + 1, row])):
            raise ModelError(
                f"linearize: state {name!r} is not at rest: its rate is {rate:.3g} at {value:.6g}; linearise about a "
                "motion in which it is constant (for a user force: set its initial state to the constant value)"
            )
    return NamedStates(tuple(name for name, _ in found), tuple(unit for _, unit in found))


def rates_of_states(small: SmallMotions, parts: Tangents, Omega: Array) -> Rows:
    """Return rates of states as linear functions of small motions."""
    by_place, by_rate, by_wrench = parts.rates_of_states(Omega)
    rows = small.by_motion(by_place)
    return Rows(rows.x, small.by_motion(by_rate).x, rows.a, by_wrench)


def with_states(parts: dict[str, Array], n_states: int) -> dict[str, Array]:
    """Return the matrices extended from motions to motions and states.

    The given matrices have the states as their last inputs, and the rates of the states, L z + L_rate z' +
    L_acceleration z'' + D s, as their last outputs.
    """
    if not n_states:
        return parts
    n, n_y, n_s = parts["M"].shape[0], len(parts["L"]) - n_states, parts["B"].shape[1] - n_states
    zero, none = np.zeros((n, n_states)), np.zeros((n_states, n_states))
    found: dict[str, Array] = {}
    for name, rows, own in (("M", "L_acceleration", none), ("C", "L_rate", np.eye(n_states)),
                            ("K", "L", -parts["D"][n_y:, n_s:])):  # fmt: skip
        by_states = -parts["B"][:, n_s:] if name == "K" else zero
        found[name] = np.block([[parts[name], by_states], [-parts[rows][n_y:], own]])
    for suffix in ("", "_rate", "_acceleration"):
        B, L, D = parts[f"B{suffix}"], parts[f"L{suffix}"], parts[f"D{suffix}"]
        found[f"B{suffix}"] = np.vstack([B[:, :n_s], D[n_y:, :n_s]])
        found[f"L{suffix}"] = np.hstack([L[:n_y], D[:n_y, n_s:]])
        found[f"D{suffix}"] = D[:n_y, :n_s]
    found["N"] = np.hstack([parts["N"], np.zeros((len(parts["N"]), n_states))])
    return found


def motions_of_inputs(
    small: SmallMotions, parts: Tangents, by_inputs: Inputs, N: Array, K_z: Array, D_0: Array, moves: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return Y with G Y + E = 0, which needs no force along motions that K_z resists, and the sizes of its terms.

    Both have the shape (n_u, n_s). Y begins as a rigid motion if a base moves the whole system, and otherwise as the
    smallest solution of G Y + E = 0. Then a motion allowed by the joints is added, which removes the forces.

    Parameters
    ----------
    moves
        Whether each input is a motion, (n_s,) bool; Y is zero for forces.
    """
    E = by_inputs.E[parts.holds]
    Y = np.zeros((small.n_u, E.shape[1]))
    free, _ = parts.body_forces(by_inputs)
    lengths, rows = small.compiled.motion_lengths, small.compiled.gap_sizes[parts.holds]
    for k, base in enumerate(small.bases):
        if base.moved:
            rigid = small.rigid(base)
            size = rows * np.abs(rigid * lengths).max() / small.compiled.length
            if (np.abs(parts.G @ rigid + E[:, k]) <= RANK * size).all():
                Y[:, k] = rigid
                continue
        if moves[k] and E[:, k].any():
            G, moved = parts.G / lengths / rows[:, None], E[:, k] / rows
            Y[:, k] = -np.linalg.lstsq(G, moved, rcond=RANK)[0] / lengths
    size = np.abs(Y)
    if moves.any():
        load = without_rounding(N, free[:, moves], D_0, Y[:, moves], size[:, moves])
        scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(K_z)), np.abs(K_z).max(initial=0.0) * RANK + TINY))
        shift = scale[:, None] * np.linalg.lstsq(scale[:, None] * K_z * scale, scale[:, None] * load, rcond=RANK)[0]
        Y[:, moves] += N @ shift
        size[:, moves] += np.abs(N) @ np.abs(shift)
    return Y, size


def without_rounding(N: Array, force: Array, D: Array, Y: Array, size: Array) -> Array:
    """Return Nᵀ (force - D Y) with entries set to zero that are rounding errors of cancelled terms.

    Parameters
    ----------
    size
        Magnitudes of the terms of Y, (n_u, n_s).
    """
    return settled(N.T @ (force - D @ Y), (N.T, force), (N.T, np.abs(D) @ size))


def named_motions(
    system: System, by_bodies: Array, of_joints: dict[str, Array], N: Array, n_states: int
) -> NamedMotions:
    """Return moving joint coordinates, modal coordinates and body frame motions as rows for z."""
    length, found = system.units.length_symbol, []
    sizes = compiled_system(system).motion_lengths
    N, by_bodies = without_noise(N, sizes), without_noise(by_bodies, sizes)
    for name, row in of_joints.items():
        unit = "rad" if name.rpartition(".")[2].startswith("angle") else length
        moved = settled(row @ N, (row, N))
        most = np.abs(row) @ (1 / sizes) * (np.abs(N) * sizes[:, None]).max(axis=0, initial=0.0)
        found.append((name, unit, moved, 0 if (np.abs(moved) > FAINT * most).any() else 3))
    first = 0
    for body in system.bodies:
        n_q = body.reduced.n_q if isinstance(body, FlexibleBody) else 0
        rows = by_bodies[first : first + 6 + n_q]
        unit = unit_words(system.units, "modal")
        found += [(f"{body.name} mode {k + 1}", unit, rows[6 + k], 1) for k in range(n_q)]
        frame = zip(("x", "y", "z", "rx", "ry", "rz"), (length,) * 3 + ("rad",) * 3, rows[:6], strict=True)
        found += [(f"{body.name} {name}", symbol, row, 2) for name, symbol, row in frame]
        first += 6 + n_q
    names, units, over_z, ranks = zip(*found, strict=True)
    rows = np.pad(np.array(over_z), ((0, 0), (0, n_states)))
    return NamedMotions(names, units, rows, ranks, system.units.time_symbol)


def modes_among_motions(system: System) -> NDArray[np.bool_]:
    """Return which unknowns of the bodies are modal coordinates, (n_u,)."""
    u0 = compiled_system(system).model.bodies.u0
    return np.concatenate([np.arange(size) >= 6 for size in np.diff(u0)])


def without_noise(motions: Array, sizes: Array) -> Array:
    """Return body motions as functions of z, with rounding errors set to zero.

    An entry is a rounding error if it is small compared with the largest entry of its column, both taken as lengths.
    """
    size = np.abs(motions) * sizes[:, None]
    return np.where(size <= NOISE * size.max(axis=0, initial=0.0), 0.0, motions)


def seen_from(T: Array, mass: Array) -> Array:
    """Return the mass matrix for coordinates T x from the mass matrix for x."""
    by_x = np.linalg.inv(T)
    return np.asarray(by_x.T @ mass @ by_x)


def massive_and_massless(M: Array) -> tuple[Array, Array]:
    """Return bases of motions with mass, (n, n_massive), and without, (n, n_massless), for a mass matrix, (n, n)."""
    scale = 1 / np.sqrt(np.maximum(np.diag(M), np.finfo(float).tiny))
    values, vectors = la.eigh(scale[:, None] * M * scale)
    is_massive = values > MASSLESS
    static = scale[:, None] * vectors[:, ~is_massive]
    # scaled so that a massless motion with a tiny diagonal mass does not degrade the others
    static /= np.linalg.norm(static, axis=0)
    return scale[:, None] * vectors[:, is_massive], static


def allowed_motions(system: System, G: Array) -> Array:
    """Return a basis of the null space of G, (n_u, n_z), with one column for each motion that stays independent.

    Some motions d depend on the others i: N_i = 1 and N_d = -G_d⁺ G_i. Motions of bodies become dependent before modes,
    so that stiff modes have their own columns: in a mixed basis, the roundoff of a stiffness of 1e10 hides motions of a
    few hertz.
    """
    sizes = compiled_system(system).motion_lengths
    is_mode = modes_among_motions(system)
    C = G / sizes
    size = np.linalg.norm(C, axis=1)
    C = C[size > 0] / size[size > 0, None]
    dependent = dependent_coordinates(C * np.where(is_mode, MODE, 1.0), np.where(is_mode, 0, 1))
    free = np.setdiff1d(np.arange(len(sizes)), dependent)
    N = np.eye(len(sizes))[:, free]
    if len(dependent):
        by_free = np.linalg.lstsq(C[:, dependent], C[:, free], rcond=None)[0]
        N[dependent] = -by_free * sizes[free] / sizes[dependent, None]
    return N
