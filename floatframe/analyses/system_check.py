"""Check of a system before its run: mobility, placement, frequencies, step size, range of its bodies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.record import QualityRecord, Verdict
from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import allowed_motions, massive_and_massless
from floatframe.analyses.linear.system_modes import undamped_modes
from floatframe.analyses.system_matrices import Tangents, tangents
from floatframe.engine.compiling.file_frames import state_of_engine
from floatframe.engine.compiling.placing import held_directions, placed_bodies
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.freedoms import Mobility
from floatframe.engine.initial_conditions.initial import ConsistentState, consistent_motion, mobility
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.initial_conditions.placement import REPORTED, body_sizes
from floatframe.engine.kernels.work import new_work
from floatframe.errors import FloatframeError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.simulation.integrate import checked_times, number_of_steps
from floatframe.simulation.step_advice import FOLLOWED, SEEN, step_warnings

__all__ = ["SystemVibrations", "check_system", "system_vibrations"]

MOST_MOTIONS = 1500  #: largest number of independent motions for which frequencies are computed
STILL = 1e-6  #: frequency, relative to the highest, below which a motion counts as free
NEAR = 1e-6  #: displacement relative to the size of a body, or relative change of velocities, that is not reported


@dataclass(frozen=True)
class SystemVibrations:
    """Undamped vibrations of a system at one state, with joints, forces and springs.

    Parameters
    ----------
    frequencies
        From the lowest, without free motions, (n,) [1 over the unit of time].
    bodies
        The body with most of the kinetic energy of each vibration.
    n_free
        Number of motions without stiffness.
    n_unstable
        Number of motions with negative stiffness, for which the state is not a minimum of the potential energy.
    """

    frequencies: Array
    bodies: tuple[str, ...]
    n_free: int
    n_unstable: int


def check_system(
    system: System,
    *,
    t_end: float | None = None,
    h: float | None = None,
    state: State | None = None,
    has_fixed_steps: bool = True,
) -> tuple[QualityRecord, ...]:
    """Return the results of all checks of a system before its run, one record for each question.

    A record "fail" means that the run would be refused, "warn" that it would run with a doubtful result.

    Parameters
    ----------
    system
        The system.
    t_end, h
        End and step size of the run [s]; None: the steps are not judged.
    state
        The state in which the run begins; None: the bodies as placed.
    has_fixed_steps
        Whether the method has the fixed step h; otherwise h is the largest step.
    """
    records = [mobility_record(system)]
    if records[0].verdict != "fail":
        try:
            made = consistent_motion(system, state)
        except FloatframeError as error:
            records.append(record("start", "State at the start", "fail", str(error)))
        else:
            parts = tangents_at(system, made)
            records += start_records(system, state, made, parts.M)
            found = system_vibrations(system, parts)
            if found is not None:
                records.append(vibration_record(system, found))
            if found is not None and h is not None:
                records.append(step_record(system, found, h, has_fixed_steps=has_fixed_steps))
    if t_end is not None and h is not None:
        try:
            _, t_end, h = checked_times(0.0, t_end, h)
            n_steps = number_of_steps(0.0, t_end, h)
        except FloatframeError as error:
            records.append(record("step", "Step size", "fail", str(error)))
        else:
            records += warning_records(system, t_end, n_steps, has_fixed_steps=has_fixed_steps)
    records += [body_record(body, system) for body in system.bodies if isinstance(body, FlexibleBody)]
    return tuple(records)


def record(
    name: str, title: str, verdict: Verdict, reason: str, action: str = "", value: float = np.nan,
    tolerance: float | None = None,
) -> QualityRecord:  # fmt: skip
    """Return a record of a check; without a remedy if none is needed."""
    return QualityRecord(name, title, value, tolerance, verdict, reason, "" if verdict in ("pass", "info") else action)


def mobility_record(system: System) -> QualityRecord:
    """Return the record about mobility and redundant constraints."""
    try:
        found = mobility(system)
    except FloatframeError as error:
        return record("mobility", "Mobility", "fail", str(error))
    words = (
        f"{found.n_freedoms} independent motions: {found.n_bodies} {'body' if found.n_bodies == 1 else 'bodies'} with "
        f"{found.n_modes} modes minus "
        f"{found.n_constraints} constraints; {found.mobility} if all bodies were rigid (Gruebler's "
        f"count: {found.gruebler})"
    )
    words += redundant_words(found)
    shares = system.redundant == "minimum-norm"
    if found.n_redundant and not shares:
        action = 'replace one of these by a joint with fewer constraints, or set redundant = "minimum-norm" in [system]'
        return record("mobility", "Mobility", "fail", words, action, found.n_redundant, 0.0)
    if found.n_redundant:
        words += "; their reactions share the load by minimum norm"
    return record("mobility", "Mobility", "pass", words, value=found.n_redundant, tolerance=0.0)


def redundant_words(found: Mobility) -> str:
    """Return the redundant constraints by joint, for flexible bodies and as if all were rigid."""

    def by_joint(counts: Mapping[str, int]) -> str:
        return ", ".join(f"{count} of joint {name!r}" for name, count in counts.items())

    words = f"; redundant: {by_joint(found.redundant)}" if found.n_redundant else "; no constraint is redundant"
    if found.n_redundant_rigid > found.n_redundant:
        words += f"; if all bodies were rigid: {by_joint(found.redundant_rigid)}"
    return words


def start_records(system: System, state: State | None, made: ConsistentState, M: Array) -> Iterator[QualityRecord]:
    """Yield the records about the start: displacement of bodies by joints, largest speed and acceleration.

    M: mass matrix of the bodies at the start, (n_u, n_u).
    """
    compiled, units = compiled_system(system), system.units
    given = compiled.placed if state is None else state_of_engine(compiled, state)
    way, size = np.linalg.norm(made.state.r - given.r, axis=1), body_sizes(compiled)
    i = int(np.argmax(way / size))
    share = float(way[i] / size[i])
    words = "the bodies lie at their joints"
    if share > NEAR:
        words = (
            f"closing the joints moves body {compiled.body_names[i]!r} by {way[i]:.3g} {units.length_symbol}, "
            f"{share:.2g} of its size"
        )
    action = "place it at its joints: from this distance it can end in another configuration"
    if state is None and compiled.by_joints.any():
        yield by_joints_record(system)
    yield record("placement", "Placement", "pass" if share <= REPORTED else "warn", words, action, share, REPORTED)
    first = compiled.model.bodies.u0[:-1]
    parts = []
    for what, values, unit in (("speed", made.state.u, ""), ("acceleration", made.u_dot, "²")):
        sizes = np.linalg.norm([values[u : u + 3] for u in first], axis=1)
        i = int(np.argmax(sizes))
        parts.append(
            f"the largest {what} is {sizes[i]:.3g} {units.length_symbol}/{units.time_symbol}{unit}, of body "
            f"{compiled.body_names[i]!r}"
        )
    if given.u.any():
        change = made.state.u - given.u
        changed = np.sqrt(max(float(change @ M @ change), 0.0) / float(given.u @ M @ given.u))
        parts.append(
            f"the joints change the given velocities by {changed:.2g} of their size"
            if changed > NEAR
            else "the given velocities fit the joints"
        )
    yield record("start", "State at the start", "pass", "; ".join(parts))


def by_joints_record(system: System) -> QualityRecord:
    """Return the record about bodies without a position: where joints placed them, and what joints leave open."""
    bodies, parts = {body.name: body for body in placed_bodies(system)}, []
    for name, n_held in held_directions(system).items():
        at = ", ".join(f"{x:.5g}" for x in bodies[name].drawn_position)
        free = {
            0: ", as drawn: no joint asks for a position",
            1: ", as drawn in the two directions that its joints leave free",
            2: ", as drawn in the direction that its joints leave free",
            3: "",
        }[n_held]
        parts.append(f"{name!r} begins at [{at}] {system.units.length_symbol}{free}")
    return record("no position", "Bodies without a position", "info", "; ".join(parts))


def tangents_at(system: System, made: ConsistentState) -> Tangents:
    """Return the mass, damping and stiffness matrices of a system at a consistent state."""
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    set_iterate(work, made.state, made.u_dot, made.w)
    return tangents(compiled.model, work)


def system_vibrations(system: System, parts: Tangents) -> SystemVibrations | None:
    """Return the undamped vibrations at one state; None if there are too many motions, or none.

    They are the solutions of K z = omega² M z for the motions that the joints allow, as if the system were at rest. (A
    rotation or acceleration of the whole system changes the low frequencies.) Motions without mass follow the others
    statically.

    Parameters
    ----------
    system
        The system.
    parts
        Its matrices at this state.
    """
    compiled, N = compiled_system(system), allowed_motions(system, parts.G)
    if not 0 < N.shape[1] <= MOST_MOTIONS:
        return None
    M, K = N.T @ parts.M @ N, N.T @ parts.K @ N
    M, K = (M + M.T) / 2, (K + K.T) / 2
    T, static = massive_and_massless(M)
    if static.shape[1]:
        T = T - static @ la.solve(static.T @ K @ static, static.T @ K @ T)
    squares, Z = undamped_modes(T.T @ K @ T, T.T @ M @ T)
    highest = float(np.abs(squares).max(initial=0.0))
    vibrates, unstable = squares > STILL**2 * highest, squares < -(STILL**2) * highest
    moves = (N @ T @ Z)[:, vibrates]
    energy = [
        np.einsum("ik,ij,jk->k", moves[u:v], parts.M[u:v, u:v], moves[u:v])
        for u, v in pairwise(compiled.model.bodies.u0)
    ]
    return SystemVibrations(
        frequencies=np.sqrt(squares[vibrates]) / (2 * np.pi),
        bodies=tuple(compiled.body_names[k] for k in np.argmax(energy, axis=0)),
        n_free=int((~vibrates & ~unstable).sum()),
        n_unstable=int(unstable.sum()),
    )


def vibration_record(system: System, found: SystemVibrations) -> QualityRecord:
    """Return the record about frequencies at the start."""
    hertz = 1 / system.units.time
    f, words = found.frequencies * hertz, "no vibration"
    if len(f):
        words = (
            f"{len(f)} vibration{'s' * (len(f) != 1)} at the start, from {f[0]:.4g} Hz (mostly body "
            f"{found.bodies[0]!r}) to {f[-1]:.4g} Hz (mostly body {found.bodies[-1]!r})"
        )
    words += f"; {found.n_free} motion{'s' * (found.n_free != 1)} without stiffness" if found.n_free else ""
    words += f"; {found.n_unstable} with negative stiffness" if found.n_unstable else ""
    return record("vibrations", "Vibrations", "info", words)


def step_record(system: System, found: SystemVibrations, h: float, *, has_fixed_steps: bool) -> QualityRecord:
    """Return the record about the step size compared with the periods of the vibrations."""
    second, f = system.units.time_symbol, found.frequencies
    if not len(f):
        return record("step", "Step size", "pass", f"h = {h:g} {second}; there is no vibration to follow")
    steps = 1 / (h * f)
    followed, unseen = int((steps >= FOLLOWED * (1 - 1e-9)).sum()), int((steps < SEEN).sum())
    words = (
        f"h = {h:g} {second} resolves {followed} of {len(f)} vibrations (at least {FOLLOWED:g} steps per period; "
        f"the slowest has {steps[0]:.3g})"
        f"{f'; {unseen} have less than {SEEN:g} steps per period' if unseen else ''}; the slowest needs "
        f"h = {1 / (FOLLOWED * f[0]):.2g} {second}, the fastest {1 / (FOLLOWED * f[-1]):.2g} {second}"
    )
    if not has_fixed_steps:
        words += "; the method takes shorter steps where its tolerance requires it"
    verdict: Verdict = "pass" if followed or not has_fixed_steps else "warn"
    action = f"take h = {1 / (FOLLOWED * f[0]):.2g} {second} or less, or leave the step to error_tolerance"
    return record("step", "Step size", verdict, words, action, float(steps[0]), FOLLOWED)


def warning_records(system: System, t_end: float, n_steps: int, *, has_fixed_steps: bool) -> list[QualityRecord]:
    """Return a record for each message about the step size with which the run begins."""
    found = step_warnings(system, 0.0, t_end / n_steps, n_steps, has_steps_of_one_size=has_fixed_steps)
    return [
        record("body modes", "Step size and modes of bodies", "warn", words, "take a smaller h")
        if kind == "modes"
        else record("function of time", "Functions of time", "warn", words, "change h or the table")
        for kind, words in found
    ]


def body_record(body: FlexibleBody, system: System) -> QualityRecord:
    """Return the record about a flexible body: modes, their highest frequency, and stiffening."""
    reduced = body.reduced
    squares = la.eigvalsh(reduced.K, reduced.M) if reduced.n_q else np.zeros(0)
    highest = float(np.sqrt(max(squares.max(initial=0.0), 0.0))) / (2 * np.pi * system.units.time)
    words = f"{reduced.n_q} modes up to {highest:.4g} Hz alone in its frame"
    if body.is_stiffened:
        words += "; geometric stiffening acts"
    else:
        why = "switched off" if reduced.geometric else "not in its file"
        words += f"; geometric stiffening is {why}: fast rotation and large axial loads do not stiffen it"
    return record(f"body {body.name}", f"Body {body.name!r}", "info", words)
