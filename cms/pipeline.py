"""From a job file to a modal file, on one page: the steps of `cms reduce` in their order.

(1) read          the job, what to reduce and how: cms/jobs/job.py
(2) assemble      mesh, deck, tables or matrices to a body with M and K: cms/jobs/body_of_job.py
(3) couple        rigid, distributing and nodal interfaces: fe_models/body/couplings
(4) plan          solver, memory, geometric stiffness, before the long work: `Plan`, below
(5) families      one factorisation of K, for constraint and vibration modes: cms/modes/families
(6) mode set      columns over the dofs of the body: cms/modes/mode_sets
(7) unit states   static states of unit loads: cms/reduction/geometric_stiffness/unit_states.py
(8) reduce        independent orthonormal basis in a body frame, moments, stress, error estimates:
                  cms/reduction/reduction.py
(9) write         the modal file, by `cms.write`: cms/body/modal_file/file.py
"""

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cms.body.reduced_body import ReducedBody
from cms.errors import JobError, MemoryBudgetError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.mode_set_of_job import frame_of, job_mode_set, reduction_of
from cms.linear_algebra.memory.budget import ReductionShape, columns_within, solver_within
from cms.linear_algebra.memory.size import memory_bytes, resident_bytes
from cms.linear_algebra.solvers.registry import solver_of
from fe_models.body.fe_body import FEBody
from fe_models.files.decks.deck import Deck
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.solver import Solver
from fe_models.foundation.stages import Stages
from fe_models.foundation.toml_file import validated

if TYPE_CHECKING:
    from cms.modes.families.cost import Asked
    from cms.modes.families.families import Families
    from cms.modes.mode_set import ModeSet
    from cms.reduction.geometric_stiffness.unit_states import UnitStates

__all__ = ["Plan", "budget_of", "expected_columns", "reduce_deck", "reduce_job", "reduced", "states_of_job"]

log = logging.getLogger(__name__)

GUESSED_MODES = 50  #: assumed number of modes for the memory estimate if a cutoff or "auto" determines the number


def reduce_job(
    job: Job | Path | str,
    stages: Stages | None = None,
    *,
    solver: str | Solver | None = None,
    memory: str | float | None = None,
    on_report: Callable[[Any], None] | None = None,
    deck: Deck | None = None,
) -> ReducedBody:
    """Process a job up to the reduced body.

    Parameters
    ----------
    job
        A job file, or a job that has been read.
    stages
        Receives durations and progress of the stages; None: neither is reported.
    solver
        Name of the solver (`cms.linear_algebra.solvers.registry`); overrides the solver of the job. Default: the
        fastest installed solver.
    memory
        Largest memory of the process, such as "8GB" or a number of bytes. Above it, the factor goes to disk; a job that
        still does not fit fails before the factorisation. Overrides the value of the job. Default: no limit.
    on_report
        Receives the mesh report before it is checked.
    deck
        Content of the deck of the job, if it is known; it is not read again.

    Raises
    ------
    CmsError, FeModelsError
        If the job, the mesh, a material, an interface, the mode set or the solver is invalid.

    Examples
    --------
    >>> body = cms.reduce_job("rod.toml")                                          # doctest: +SKIP
    >>> cms.write(body, "rod.h5")                                                  # doctest: +SKIP
    """
    from cms.modes.families.families import Families

    job = job if isinstance(job, Job) else read_job(Path(job))  # (1)
    stages = stages or Stages()
    chosen = solver_of(solver or job.reduction.solver)  # a solver that is not installed is reported before any work
    budget = budget_of(job, solver, memory)
    ranks = None if chosen.spread is None else all_ranks()
    body = job_body(job, stages, on_report=on_report, source=deck, ranks=ranks)  # (2), (3)
    plan = Plan.of(job, body, chosen, budget)  # (4)
    announce = not job.reduction.reduces_interfaces  # announce the cost of many boundary dofs, unless they are reduced
    with Families(body, announce=announce, solver=plan.solver, to_disk=plan.to_disk) as families:
        with stages(f"mode set {job.reduction.set}"):
            modes = job_mode_set(families, reduction_of(job, body))  # (5), (6)
        states = None
        if plan.needs_states(len(modes.labels)):
            with stages("static states"):
                states = states_of_job(job, families)  # (7)
        if job.recovery or plan.estimates is not False:  # static parts and error estimates need the factorisation
            return reduced(job, plan, families, modes, states, stages)  # (8)
    return reduced(job, plan, body, modes, states, stages)  # (8), with the memory of the factorisation free


def reduce_deck(
    path: Path | str,
    *,
    units: str,
    reduction: Mapping[str, Any] | None = None,
    program: str | None = None,
    densities: Mapping[str, float] | None = None,
    leave_out: Iterable[str] = (),
    mass: str | None = None,
    stages: Stages | None = None,
) -> ReducedBody:
    """Read a complete deck of another program, and reduce its body, without a job file.

    The result is that of the job that `cms job` writes: supports of the deck become interfaces of a free body.

    Parameters
    ----------
    path, units, program, densities, leave_out, mass
        As for `fe_models.read_deck`.
    reduction
        Keys of the table [reduction] of a job, such as {"set": "rubin", "n_modes": 20}. Default: ten modes of
        Craig-Bampton if the deck has supports, else ten normal modes.
    stages
        Receives durations and progress of the stages; None: neither is reported.

    Raises
    ------
    CmsError, FeModelsError
        If the deck cannot be read or converted, or the mode set is invalid.

    Examples
    --------
    >>> body = cms.reduce_deck("arm.bdf", units="mm-t-s", reduction={"set": "rubin", "n_modes": 20})  # doctest: +SKIP
    """
    from cms.jobs.decks.job_text import job_tables
    from fe_models.files.model_of_deck import DeckOptions
    from fe_models.files.read_deck import parse_deck

    deck = parse_deck(path, program=program)
    tables = job_tables(deck, DeckOptions(units, densities or {}, tuple(leave_out), mass), str(Path(path).resolve()))
    if reduction is not None:
        tables["reduction"] = dict(reduction)
    job = validated(Job, tables, Path(path), JobError)
    return reduce_job(job, stages, deck=deck)


def states_of_job(job: Job, families: "Families") -> "UnitStates":
    """Return the static states of unit loads for the geometric stiffness that a job requests."""
    from cms.reduction.geometric_stiffness.unit_states import unit_states

    asked = job.reduction.geometric_stiffness
    return unit_states(
        families,
        frame=frame_of(job),
        spread=job.reduction.spread_loads is not False,
        interfaces=asked if isinstance(asked, list) else None,
    )


def reduced(
    job: Job,
    plan: "Plan",
    source: "FEBody | Families",
    modes: "ModeSet",
    states: "UnitStates | None",
    stages: Stages,
) -> ReducedBody:
    """Reduce the coupled body of a job to its modes.

    Parameters
    ----------
    plan
        What was decided about the geometric stiffness.
    source
        The coupled body, or its families, whose factorisation recovery rows use.
    states
        Static states of the unit loads; None: without geometric stiffness.
    """
    from cms.jobs.tables.recovery_section import requests_of
    from cms.reduction.reduction import reduce

    with stages("reduce"):
        made = reduce(
            source,
            modes,
            frame=frame_of(job, held=plan.body.is_held) if states is None else None,
            damping=None if job.damping is None else job.damping.damping,
            stress=job.reduction.stress is not False,
            quadratic=bool(job.reduction.quadratic_modes),
            geometric=False if states is None else states,
            recovery=requests_of(job.recovery) if job.recovery else (),
            errors=plan.estimates,
        )
    left_out = plan.left_out(len(modes.labels)) if states is None else ""
    return replace(made, provenance={**made.provenance, "geometric stiffness": left_out}) if left_out else made


# (4) what is decided before the long work -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Plan:
    """Decisions before the expensive part of a reduction: solver, storage of columns, and geometric stiffness."""

    body: FEBody  #: coupled body
    #: geometric stiffness: True, False, or the interfaces whose loads it includes; None: only if it is small
    asked: "Asked"
    is_requested: bool  #: whether the job requests the geometric stiffness, or quadratic modes, which require it
    #: whether the geometric stiffness is computed only if it is small: the job leaves it open, and elements support it
    is_optional: bool
    solver: Solver | None = None  #: solver for the factorisation; None: the fastest installed one
    to_disk: bool = False  #: whether the columns are stored on disk
    estimates: bool | None = None  #: whether errors are estimated; None: if the mode set has a factorisation

    @classmethod
    def of(cls, job: Job, body: FEBody, solver: Solver, budget: float | None) -> "Plan":
        """Plan the reduction of a coupled body within a memory budget [bytes], None: without a limit.

        The log gets the cost of a large geometric stiffness, or that it will be left out.

        Raises
        ------
        BodyError
            If the geometric stiffness is requested, but the elements do not know it, an interface is unknown, or the
            memory of this machine does not suffice; or if error estimates are requested of a distributed body.
        """
        from cms.modes.families.cost import require_room_for_stiffness, stiffness_words
        from cms.reduction.error_estimates import require_one_process
        from cms.reduction.geometric_stiffness.unit_states import require_geometric_stiffness

        estimates = job.reduction.error_estimates if budget is None else False
        if estimates:
            require_one_process(body)
        plan = replace(cls.of_stiffness(job, body), solver=solver, estimates=estimates)
        n_columns = min(expected_columns(job, body), body.n_dof)  # the mode set refuses a job with more modes
        words = plan.left_out(n_columns)
        if plan.is_requested:
            require_geometric_stiffness(body)
            for name in plan.asked if isinstance(plan.asked, list) else ():
                body.interface(name)  # raises an error for an unknown name before the expensive work
            require_room_for_stiffness(body, n_columns, plan.asked)
            words = stiffness_words(body, n_columns, plan.asked)
        if words:
            log.warning("body %r: %s", body.name, words)
        if budget is None:
            return plan
        n_modes = job.reduction.n_modes if isinstance(job.reduction.n_modes, int) else GUESSED_MODES
        shape = columns_within(budget, ReductionShape(body.n_dof, len(body.b) + n_modes, n_modes, resident_bytes()))
        return replace(plan, solver=solver_within(budget, shape), to_disk=shape.to_disk)

    @classmethod
    def of_stiffness(cls, job: Job, body: FEBody) -> "Plan":
        """Plan only the geometric stiffness, for several reductions with one factorisation."""
        from cms.reduction.geometric_stiffness.unit_states import has_geometric_stiffness

        asked = job.reduction.geometric_stiffness
        is_requested = bool(job.reduction.quadratic_modes) or asked not in (None, False)
        return cls(body, asked, is_requested, not is_requested and asked is None and has_geometric_stiffness(body))

    def needs_states(self, n_modes: int) -> bool:
        """Return whether a mode set of this size needs the static states of unit loads."""
        return self.is_requested or (self.is_optional and not self.left_out(n_modes))

    def left_out(self, n_modes: int) -> str:
        """Return a note if an optional geometric stiffness is omitted because it is large; otherwise ""."""
        from cms.modes.families.cost import left_out_words

        return left_out_words(self.body, n_modes) if self.is_optional else ""


def budget_of(job: Job, solver: str | Solver | None, memory: str | float | None) -> float | None:
    """Return the memory limit of a reduction [bytes]; None: no limit.

    Raises
    ------
    MemoryBudgetError
        If the solver or the mode set cannot be held to it.
    """
    allowed = memory if memory is not None else job.reduction.memory
    if allowed is None:
        return None
    budget, asked = memory_bytes(allowed), solver or job.reduction.solver
    if asked not in (None, "cholesky"):
        raise MemoryBudgetError(
            f"memory = {allowed}: belongs to solver cholesky, whose memory is known before; got solver {asked!r}"
        )
    if job.reduction.set == "multilevel":
        raise MemoryBudgetError(
            f"memory = {allowed}: the tree of the set multilevel is not held to it; take craig-bampton, or no memory"
        )
    if job.reduction.error_estimates:
        raise MemoryBudgetError(
            f"memory = {allowed}: the memory of error estimates is not planned; remove error_estimates, or memory"
        )
    return budget


def expected_columns(job: Job, body: FEBody) -> int:
    """Return a lower bound on the number of columns of the mode set of a job, before it is computed."""
    from cms.modes.families.cost import interface_reduction_size
    from cms.modes.mode_sets import INTERFACE_SETS

    found = len(body.b)
    if job.reduction.reduces_interfaces:
        found = interface_reduction_size(body, job.reduction.interface_modes or 0)
    if job.reduction.set not in INTERFACE_SETS:
        found = 0
    return found + (job.reduction.n_modes if isinstance(job.reduction.n_modes, int) else 0)
