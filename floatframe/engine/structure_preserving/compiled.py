"""A discrete system in the arrays of the compiled steps: constants, sparsity of derivatives and working arrays."""

import weakref
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.initial_conditions.initial import has_normal_friction
from floatframe.engine.initial_conditions.newton_equations import modal_matrix, modal_weight
from floatframe.engine.kernels.connections.contact import V_0
from floatframe.engine.kernels.model import CONTACT, STIFFNESS, USER_FORCE, Model
from floatframe.engine.kernels.records import filled, measured, zeros
from floatframe.engine.kernels.work import Work, sizes_of
from floatframe.engine.structure_preserving.bodies import CentralBody
from floatframe.engine.structure_preserving.kernels.records import N_BLOCKS, SMALL, Discrete, Pattern, StepWork
from floatframe.engine.structure_preserving.system import DiscreteSystem
from floatframe.model.joints.rows import is_held_length, is_held_velocity

__all__ = ["Kept", "kept_of", "new_step_work"]


@dataclass(frozen=True, eq=False)
class Filter:
    """Matrices of the numerical dissipation of one body's modes."""

    F: Array  #: (1 + 2 Phi chi Phiᵀ M_e)⁻¹ Phi chi Phiᵀ, (n, n)
    X: Array  #: Phi chi Phiᵀ M_e, (n, n)
    E: Array  #: J⁻¹ B, (3, n): a free body without angular momentum rotates with -E q_dot


def filter_of(body: CentralBody, h: float, rho_inf: float) -> Filter:
    """Return the numerical dissipation of a body's modes for steps of size h."""
    M = body.mass_matrix
    E = np.asarray(np.linalg.solve(M[:3, :3], M[:3, 3:]), dtype=np.float64)
    effective = M[3:, 3:] - M[3:, :3] @ E
    squares, Phi = la.eigh(body.K, 0.5 * (effective + effective.T))
    x = h**2 * np.maximum(squares, 0.0)
    chi = 0.5 * (1 - rho_inf) / (1 + rho_inf) * x / (1 + x)
    X = (Phi * chi) @ Phi.T @ effective
    return Filter((Phi * (chi / (1 + 2 * chi))) @ Phi.T, X, E)


def constants_of(ds: DiscreteSystem, h: float, rho_inf: float) -> tuple[Array, IntArray]:
    """Return the constants of all body types in one flat array, and the index of each, (n_t, N_BLOCKS)."""
    model, parts, place = ds.model, [], 0
    block0 = np.zeros((len(model.body_types.mass), N_BLOCKS), dtype=np.int64)
    done = set()
    for i, body in enumerate(ds.bodies):
        t, n = int(model.bodies.kind[i]), body.n
        if t in done:
            continue
        done.add(t)
        none = Filter(np.zeros((n, n)), np.zeros((n, n)), np.zeros((3, n)))
        of_modes = filter_of(body, h, rho_inf) if rho_inf < 1.0 and n else none
        for which, array in enumerate((body.S_ab_T, of_modes.F, of_modes.X, of_modes.E)):
            block0[t, which] = place
            parts.append(np.ascontiguousarray(array).ravel())
            place += array.size
    return np.concatenate([*parts, np.zeros(0)]), block0


def pattern_of(ds: DiscreteSystem) -> tuple[Pattern, dict[str, int]]:
    """Return the sparsity of the derivatives: numbers of blocks, their rows, and their colors.

    A block affects its own rows and those of the blocks with which it shares a connection. Blocks that affect no common
    row are varied together.
    """
    model, n_b = ds.model, len(ds.bodies)
    u0 = model.bodies.u0
    unknowns = [np.arange(u0[i], u0[i + 1]) for i in range(n_b)]
    near: list[set[int]] = [{i} for i in range(n_b)]
    for c in ds.connections:
        bodies = set(c.bodies)
        together = set(bodies)
        multipliers = int(u0[-1]) + c.first + np.arange(len(c.held))
        states = int(u0[-1]) + ds.n_held + c.first_state + np.arange(len(c.states))
        for own in (multipliers, states):
            if len(own):
                together.add(len(unknowns))
                unknowns.append(own)
                near.append(set())
        for block in together:
            near[block] |= together
    rows = [np.concatenate([unknowns[k] for k in sorted(blocks)]) for blocks in near]
    n_z = sum(map(len, unknowns))
    block_of = np.zeros(n_z, dtype=np.int64)
    for k, own in enumerate(unknowns):
        block_of[own] = k
    colors: list[list[int]] = []
    taken: list[set[int]] = []  # rows that the blocks of each group affect
    groups: list[list[int]] = []
    for k in range(len(unknowns)):
        free = next((g for g, used in enumerate(taken) if not used & near[k]), len(taken))
        if free == len(taken):
            taken.append(set())
            groups.append([])
        taken[free] |= near[k]
        groups[free].append(k)
    for group in groups:
        for j in range(max(len(unknowns[k]) for k in group)):
            colors.append([int(unknowns[k][j]) for k in group if j < len(unknowns[k])])
    row = np.concatenate([rows[block] for block in block_of])
    column = np.repeat(np.arange(n_z), [len(rows[block]) for block in block_of])
    graph = sp.csr_array((np.ones(len(row)), (row, column)), shape=(n_z, n_z))
    order = reverse_cuthill_mckee(graph, symmetric_mode=True)
    place = np.empty(n_z, dtype=np.int64)
    place[order] = np.arange(n_z)
    reach = int(np.abs(place[row] - place[column]).max())
    made = filled(
        Pattern(), place=place, block=block_of, row0=np.cumsum([0, *map(len, rows)]), row=np.concatenate(rows),
        color0=np.cumsum([0, *map(len, colors)]), column=np.concatenate([np.array(color) for color in colors]),
        below=reach, above=reach,
    )  # fmt: skip
    return made, {"width": 3 * reach + 1}


def discrete_of(ds: DiscreteSystem, scheme: int, h: float, rho_inf: float) -> tuple[Discrete, dict[str, int]]:
    """Return the arrays with which compiled code advances a system by steps of size h.

    The second value gives the sizes of the working arrays.
    """
    model = ds.model
    pattern, sizes = pattern_of(ds)
    blocks, block0 = constants_of(ds, h, rho_inf)
    n_u = int(model.bodies.u0[-1])
    weight, scale, mass = np.zeros(n_u), np.zeros(n_u), sum(body.m for body in ds.bodies)
    delta = np.zeros(n_u)
    for i, body in enumerate(ds.bodies):
        own = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        modal = np.diag(body.M) + 0.25 * h**2 * np.diag(body.K)
        weight[own] = np.concatenate([np.full(3, body.m), np.diag(body.J0), modal])
        delta[own] = SMALL * ds.length * np.sqrt(body.m / weight[own])
        scale[own] = ds.length * np.sqrt(mass / weight[own])
    held = ds.held
    is_length = is_held_length(model.rows.kind[held]) | is_held_velocity(model.rows.kind[held])
    of_multipliers = mass * ds.length * np.where(is_length, 1.0, ds.length)
    of_held_rows = of_multipliers / (mass * ds.length**2)
    equation = np.flatnonzero(np.isin(held, model.laws.equation))
    of_multipliers[equation], of_held_rows[equation] = 0.5 * h**2 * model.laws.equation_size, 1.0
    of_states = np.maximum(model.states.size, np.abs(model.states.start))
    slides = model.markers.line >= 0
    turns = [ds.turns(m) or bool(slides[m]) for m in range(len(slides))]
    sizes_of_markers = [ds.bodies[int(i)].n if i >= 0 else 0 for i in model.markers.body]
    weighted = [modal_weight(model, i) * modal_matrix(model, i, STIFFNESS) for i in range(len(ds.bodies))]
    row_scale = np.concatenate([scale / (mass * ds.length**2), of_held_rows])
    scale = np.concatenate([scale, of_multipliers, of_states])
    made = filled(
        Discrete(), scheme=scheme, is_filtered=int(rho_inf < 1.0),
        is_loaded=int(does_work(model)), blocks=blocks, block0=block0, turns=turns,
        psi0=np.cumsum([0, *sizes_of_markers])[:-1], first=[*(c.first for c in ds.connections), ds.n_held], row=held,
        is_driven=[ds.is_driven(c, k) for c in ds.connections for k in c.held], weight=weight, scale=scale,
        row_scale=np.concatenate([row_scale, 1.0 / of_states]),
        delta=np.concatenate([delta, SMALL * of_multipliers, SMALL * of_states]), remembered=remembered_rows(model),
        is_linear=int(not has_normal_friction(model) and not model.laws.head[:, 2:4].any()), equation=equation,
        weighted=np.concatenate([*(part.ravel() for part in weighted), np.zeros(0)]),
        weighted0=np.cumsum([0, *(part.size for part in weighted)])[:-1], pattern=pattern,
    )  # fmt: skip
    return made, sizes | {"6 n of markers": 6 * sum(sizes_of_markers)}


def does_work(model: Model) -> bool:
    """Whether forces other than potential forces and modal damping do work."""
    springs = model.springs
    counts = (
        model.loads.marker, model.body_loads.body, model.joint_forces.motor, model.contacts.stiffness,
        model.laws.length,
    )  # fmt: skip
    return (
        any(len(each) for each in counts)
        or bool(springs.damping.any() or (springs.table >= 0).any())
        or bool(model.bushings.damping.any() or (model.bushings.table >= 0).any())
        or bool((model.connections.law == USER_FORCE).any() or (model.rows.motion >= 0).any())
    )


def remembered_rows(model: Model) -> IntArray:
    """Return the rows in which connections remember values between steps."""
    contacts = model.connections.w0[:-1][model.connections.law == CONTACT] + V_0
    rows = [model.coordinates.row, model.states.row, model.states.row + 1, contacts, model.laws.equation]
    return np.concatenate(rows).astype(np.int64)


def new_step_work(model: Model, discrete: Discrete, sizes: dict[str, int]) -> StepWork:
    """Return new working arrays for the steps of a system."""
    step = zeros(StepWork(), sizes_of(model) | measured(Discrete(), discrete) | sizes)
    step.is_due[:] = 1
    return step


#: arrays of a step that the next step uses
REMEMBERED = ("h", "band", "band_pivot", "is_due", "acceleration", "f_kept", "f_size")


@dataclass(eq=False)
class Kept:
    """Data that belong to working arrays and continue from one call of steps to the next."""

    key: tuple
    discrete: Discrete
    step: StepWork
    before: object = None  #: memory at the start of the last steps
    known: tuple[Array, ...] = ()  #: arrays `REMEMBERED` at the start of the last steps
    after: object = None  #: memory at the end of the last steps

    def go_on_from(self, memory: object, f: Array, *, is_anew: bool) -> None:
        """Prepare the arrays for steps from a memory with multipliers f, reusing those of the last steps if they fit.

        is_anew: whether to discard the memory of earlier steps, as a run resumed from a file does.
        """
        arrays = [getattr(self.step, name) for name in REMEMBERED]
        if memory is self.before and not is_anew:
            for array, value in zip(arrays, self.known, strict=True):
                array[...] = value
        elif memory is not self.after or is_anew:
            self.step.is_due[:] = 1
            self.step.acceleration[:] = 0.0
            self.step.f_kept[:] = f
            self.step.f_size[self.discrete.equation] = np.abs(f[self.discrete.equation])
        self.before, self.known = memory, tuple(array.copy() for array in arrays)


#: data by the id of an array of the working arrays; an entry is removed when that array is freed
KEPT: dict[int, Kept] = {}


def kept_of(work: Work, ds: DiscreteSystem, scheme: int, h: float, rho_inf: float) -> Kept:
    """Return the data that belong to the working arrays, for steps of size h."""
    key, wanted = id(work.solver.pivot), (scheme, h, rho_inf)
    known = KEPT.get(key)
    if known is None or known.key != wanted:
        if known is None:
            weakref.finalize(work.solver.pivot, KEPT.pop, key, None)
        discrete, sizes = discrete_of(ds, scheme, h, rho_inf)
        known = KEPT[key] = Kept(wanted, discrete, new_step_work(ds.model, discrete, sizes))
    return known
