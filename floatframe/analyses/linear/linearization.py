"""Linearisation of a system about an equilibrium or a steady rotation, in coordinates that fulfil the joints.

With N a basis of the motions the joints allow (G N = 0) and the matrices of `tangents`:

    xi = N z,  nu = N z_dot + Omega N z
    M_z = Nᵀ M N,  C_z = Nᵀ (C N + M (Omega + Omega') N),  K_z = Nᵀ (K + C Omega + M Omega' Omega) N

N does not change in time, because in body axes nothing does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array, frozen
from floatframe.analyses.equilibrium import Equilibrium, static_equilibrium
from floatframe.analyses.joint_rates import coordinate_rows
from floatframe.analyses.linear.channels import AnyChannel, StressChannel, channel_rows, channel_units, channels_of
from floatframe.analyses.system_matrices import tangents, turning_matrices
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.compiling.file_frames import motion_of_engine, small_motions_of_file
from floatframe.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.forces import UserForce
from floatframe.kernels.work import new_work
from floatframe.results.sensors.measurement import unit_words
from floatframe.start.newton_equations import linearized, set_iterate
from floatframe.system import System

if TYPE_CHECKING:
    from scipy.signal import StateSpace

__all__ = ["LinearSystem", "NamedMotions", "linearize"]

RANK = 1e-10  #: singular value of the scaled rows below which one repeats others
MASSLESS = 1e-12  #: eigenvalue of the scaled mass matrix below which a motion has no mass


@dataclass(frozen=True, eq=False)
class NamedMotions:
    """Motions that have a name, as rows over the independent motions z."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array  #: (n_names, n_z)
    ranks: tuple[int, ...]  #: joint coordinates 0, modal coordinates 1, motions of body frames 2
    time_unit: str


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """M z_ddot + C z_dot + K z = B s,  y = L d^r z/dt^r: small motions z about a steady one, inputs s, outputs y."""

    equilibrium: Equilibrium
    M: Array  #: (n_z, n_z)
    C: Array  #: with gyroscopic terms, (n_z, n_z)
    K: Array  #: with geometric, centrifugal and circulatory terms, (n_z, n_z)
    B: Array  #: (n_z, n_inputs)
    L: Array  #: (n_outputs, n_z)
    N: Array  #: motions of the bodies (translation and rotation in body axes, modes), (n_u, n_z)
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    body_names: tuple[str, ...]
    body_masses: tuple[Array, ...]  #: mass matrix of each body, (6 + n_q, 6 + n_q)
    rates: tuple[int, ...] = ()  #: r of each output: 0 displacement, 1 velocity, 2 acceleration; (): all 0
    input_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    motions: NamedMotions | None = None  #: of which states can be made, see `state_space`

    def __post_init__(self) -> None:
        for name in ("M", "C", "K", "B", "L", "N"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        if not self.rates:
            object.__setattr__(self, "rates", (0,) * len(self.outputs))

    @property
    def n_z(self) -> int:
        """Number of independent motions (the mobility, with the modes of flexible bodies)."""
        return int(self.M.shape[0])

    def bodies(self) -> Iterator[tuple[slice, Array]]:
        """Yield for each body its rows of N and its mass matrix."""
        first = 0
        for mass in self.body_masses:
            yield slice(first, first + len(mass)), mass
            first += len(mass)

    def with_mass(self) -> tuple["LinearSystem", Array]:
        """Return the system without its massless motions, which follow the others statically, and z by its motions."""
        dynamic, static = self.motions_with_and_without_mass()
        if not static.shape[1]:
            return self, np.eye(self.n_z)
        T = dynamic - static @ la.solve(static.T @ self.K @ static, static.T @ self.K @ dynamic)
        parts = {name: T.T @ getattr(self, name) @ T for name in ("M", "C", "K")}
        motions = None if self.motions is None else replace(self.motions, rows=self.motions.rows @ T)
        return replace(self, **parts, B=T.T @ self.B, L=self.L @ T, N=self.N @ T, motions=motions), T

    def motions_with_and_without_mass(self) -> tuple[Array, Array]:
        """Return bases of z: motions with mass (orthonormal by it), and those without, (n_z, n) each."""
        scale = 1 / np.sqrt(np.maximum(np.diag(self.M), np.finfo(float).tiny))
        values, vectors = la.eigh(scale[:, None] * self.M * scale)
        is_massive = values > MASSLESS
        static = scale[:, None] * vectors[:, ~is_massive]
        # scaled so that a massless motion of tiny diagonal mass does not spoil the others
        static /= np.linalg.norm(static, axis=0)
        return scale[:, None] * vectors[:, is_massive], static

    def feedthrough(self) -> Array:
        """Return the displacement outputs that follow inputs at once, over motions without mass, (n_outputs, n_inputs).

        Their velocities would be derivatives of the inputs, which a state space cannot hold: they are left out.
        """
        _, S = self.motions_with_and_without_mass()
        if not S.shape[1] or not self.B.shape[1]:
            return np.zeros((len(self.outputs), len(self.inputs)))
        D = self.L @ S @ la.solve(S.T @ self.K @ S, S.T @ self.B)
        return np.asarray(D * (np.array(self.rates) == 0)[:, None])

    def state_space(self) -> "StateSpace":
        """Return A, B, C, D over the state (z, z_dot) of the motions with mass, as `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace

        system, _ = self.with_mass()
        n = system.n_z
        factor = la.cho_factor(system.M)
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:] = np.eye(n)
        A[n:, :n] = -la.cho_solve(factor, system.K)
        A[n:, n:] = -la.cho_solve(factor, system.C)
        B = np.vstack([np.zeros((n, system.B.shape[1])), la.cho_solve(factor, system.B)])
        C = np.hstack([system.L, np.zeros_like(system.L)])
        D = self.feedthrough()
        for k, rate in enumerate(self.rates):
            if rate == 2:
                D[k] = C[k] @ A @ B
            for _ in range(rate):
                C[k] = C[k] @ A
        return StateSpace(A, B, C, D)

    def response(self, frequencies: Array) -> Array:
        """Return the frequency response y/s at frequencies [Hz], (n_frequencies, n_outputs, n_inputs), complex."""
        H = np.empty((len(frequencies), len(self.outputs), len(self.inputs)), complex)
        for k, omega in enumerate(2 * np.pi * np.asarray(frequencies, dtype=float)):
            try:
                H[k] = self.L @ np.linalg.solve(self.K + 1j * omega * self.C - omega**2 * self.M, self.B)
            except np.linalg.LinAlgError:  # an undamped resonance, met exactly
                H[k] = np.inf
            H[k] *= ((1j * omega) ** np.array(self.rates, dtype=int))[:, None]
        return H


def linearize(
    system: System,
    about: Equilibrium | None = None,
    *,
    inputs: Sequence[AnyChannel] | None = None,
    outputs: Sequence[AnyChannel] | None = None,
) -> LinearSystem:
    """Linearise a system about an equilibrium or a steady rotation.

    Parameters
    ----------
    system
        The system.
    about
        As `static_equilibrium` or `steady_rotation` returns it; the equilibrium at rest by default.
    inputs, outputs
        Channels; a channel can be both. Their directions turn with a steady rotation. None: those of the system.

    Raises
    ------
    ModelError
        If nothing can move, or a channel is at a place that does not exist.
    """
    inputs = channels_of(system.inputs) if inputs is None else tuple(inputs)
    outputs = channels_of(system.outputs) if outputs is None else tuple(outputs)
    for channel in inputs:
        if isinstance(channel, StressChannel):
            raise ModelError(f"linearize: channel {channel.name!r} is a stress: expected a force or torque as an input")
    with_states = [force.name for force in system.forces if isinstance(force, UserForce) and force.states]
    if with_states:
        raise ModelError(
            f"system {system.name!r}: force {with_states[0]!r} has states of its own, which a linearisation to M, C, K "
            "does not hold; take it out, or give its forces without states"
        )
    about = static_equilibrium(system) if about is None else about
    compiled = compiled_system(system)
    model, work = compiled.model, new_work(compiled.model)
    state, u_dot = motion_of_engine(compiled, about.state, about.u_dot)
    set_iterate(work, state, u_dot, about.w)
    shown = small_motions_of_file(compiled, state.q)
    parts = tangents(model, work)
    Omega, Omega_t = turning_matrices(model, work)
    N = allowed_motions(parts.G, compiled.length, [int(u0) for u0 in model.bodies.u0[:-1]])
    if N.shape[1] == 0:
        raise ModelError(f"system {system.name!r}: its joints and drives allow no motion; nothing can be linearised")
    by_bodies = la.block_diag(*shown) @ N
    return LinearSystem(
        about,
        M=N.T @ parts.M @ N,
        C=N.T @ (parts.C + parts.M @ (Omega + Omega_t)) @ N,
        K=N.T @ (parts.K + parts.C @ Omega + parts.M @ Omega_t @ Omega) @ N,
        B=(channel_rows(system, compiled, work, inputs) @ N).T,
        L=channel_rows(system, compiled, work, outputs) @ N,
        N=by_bodies,
        inputs=tuple(channel.name for channel in inputs),
        outputs=tuple(channel.name for channel in outputs),
        body_names=compiled.body_names,
        body_masses=tuple(
            seen_from(T, mass) for T, mass in zip(shown, linearized(model, work, 1.0, 0.0, 0.0).H, strict=True)
        ),
        rates=tuple(getattr(channel, "rate", 0) for channel in outputs),
        input_units=tuple(channel_units(system, channel)[1] for channel in inputs),
        output_units=tuple(channel_units(system, channel)[0] for channel in outputs),
        motions=named_motions(system, by_bodies, coordinate_rows(system, compiled, work, state), N),
    )


def named_motions(system: System, by_bodies: Array, of_joints: dict[str, Array], N: Array) -> NamedMotions:
    """Return the joint coordinates that move, the modal coordinates and the motions of body frames, over z."""
    length, found = system.units.length_symbol, []
    for name, row in of_joints.items():
        unit = "rad" if name.rpartition(".")[2].startswith("angle") else length
        found.append((name, unit, row @ N, 0))
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
    return NamedMotions(names, units, np.array(over_z), ranks, system.units.time_symbol)


def seen_from(T: Array, mass: Array) -> Array:
    """Return a mass matrix over the motions T x of what it is over x."""
    by_x = np.linalg.inv(T)
    return np.asarray(by_x.T @ mass @ by_x)


def allowed_motions(G: Array, length: float, bodies: list[int]) -> Array:
    """Return an orthonormal basis of the null space of G, (n_u, n_z), with rotations scaled by the length."""
    n_u = G.shape[1]
    if not len(G):
        return np.eye(n_u)
    scale = np.ones(n_u)
    for u0 in bodies:
        scale[u0 + 3 : u0 + 6] = 1 / length
    scaled = G * scale
    size = np.linalg.norm(scaled, axis=1)
    _, values, right = la.svd(scaled[size > 0] / size[size > 0, None])
    rank = int((values > RANK * values[0]).sum()) if len(values) else 0
    return scale[:, None] * right[rank:].T
