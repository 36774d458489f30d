"""All steps of a reduction job: mesh or matrices, interfaces, mode set, reduced body."""

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cms.body.reduced_body import ReducedBody
from cms.errors import MemoryBudgetError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.parts_of_job import frame_of, moving_frame_of
from cms.linear_algebra.memory.budget import ReductionShape, columns_within, solver_within
from cms.linear_algebra.memory.size import memory_bytes, resident_bytes
from cms.linear_algebra.solvers.registry import solver_of
from fe_models.body.fe_body import FEBody
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.solver import Solver
from fe_models.foundation.stages import Stages

if TYPE_CHECKING:
    from cms.assessment.quality.of_reduction.contents import ReductionOptions
    from cms.modes.families.families import Families
    from cms.modes.mode_set import ModeSet
    from cms.reduction.geometric_stiffness.unit_states import UnitStates

__all__ = ["reduce_job", "reduction_options"]

log = logging.getLogger(__name__)

GUESSED_MODES = 50  #: assumed number of modes for the memory estimate, if a cutoff or "auto" determines it


def reduce_job(
    job: Job | Path | str,
    stages: Stages | None = None,
    *,
    solver: str | Solver | None = None,
    memory: str | float | None = None,
    on_report: Callable[[Any], None] | None = None,
) -> ReducedBody:
    """Run a job up to the reduced body.

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

    job = job if isinstance(job, Job) else read_job(Path(job))
    stages = stages or Stages()
    chosen = solver_of(solver or job.reduction.solver)  # a solver that is not installed is reported before any work
    allowed = memory if memory is not None else job.reduction.memory
    budget = None if allowed is None else memory_bytes(allowed)
    if budget is not None and (asked := solver or job.reduction.solver) not in (None, "cholesky"):
        raise MemoryBudgetError(
            f"memory = {allowed}: belongs to solver cholesky, whose memory is known before; got solver {asked!r}"
        )
    if budget is not None and job.reduction.set == "multilevel":
        raise MemoryBudgetError(
            f"memory = {allowed}: the tree of the set multilevel is not held to it; take craig-bampton, or no memory"
        )
    ranks = None if chosen.spread is None else all_ranks()
    coupled = job_body(job, stages, on_report=on_report, ranks=ranks)
    announce_stiffness(job, coupled)
    to_disk = False
    if budget is not None:
        shape = columns_within(budget, shape_of(job, coupled))
        chosen, to_disk = solver_within(budget, shape), shape.to_disk
    if job.recovery:
        with Families(
            coupled, announce=not reduces_interfaces(job), solver=chosen, to_disk=to_disk
        ) as families:  # recovery rows need the factorisation for their static part
            return reduced(job, families, stages, *modes_and_states(job, families, stages))
    return reduced(job, coupled, stages, *with_own_factorisation(job, coupled, chosen, stages, to_disk))


def announce_stiffness(job: Job, body: FEBody) -> None:
    """Log the cost of the geometric stiffness before the long work, or that it will be left out.

    Raises
    ------
    BodyError
        If it is requested, but the elements do not know it, an interface is unknown, or the memory does not suffice.
    """
    from cms.reduction.geometric_stiffness import room_for_stiffness as room
    from cms.reduction.geometric_stiffness.unit_states import (
        has_geometric_stiffness,
        loaded_interfaces,
        require_geometric_stiffness,
    )

    asked = job.reduction.geometric_stiffness
    n_modes = min(expected_columns(job, body), body.n_dof)  # the mode set refuses a job that asks for more
    if asked in (None, False) and not job.reduction.quadratic_modes:
        if asked is None and has_geometric_stiffness(body) and (words := room.left_out_words(body, n_modes)):
            log.warning("body %r: %s", body.name, words)
        return
    require_geometric_stiffness(body)
    if isinstance(asked, list):
        loaded_interfaces(body, asked)
    room.require_room_for_stiffness(body, n_modes, asked)
    if words := room.stiffness_words(body, n_modes, asked):
        log.warning("body %r: %s", body.name, words)


def shape_of(job: Job, body: FEBody) -> ReductionShape:
    """Return the data that determine the peak memory of a job."""
    n_modes = job.reduction.n_modes if isinstance(job.reduction.n_modes, int) else GUESSED_MODES
    return ReductionShape(body.n_dof, len(body.b) + n_modes, n_modes, resident_bytes())


def reduced(
    job: Job, source: "FEBody | Families", stages: Stages, modes: "ModeSet", states: "UnitStates | None"
) -> ReducedBody:
    """Reduce the body of a job to its modes."""
    from cms.jobs.tables.recovery_section import requests_of
    from cms.modes.families.sharing import body_of
    from cms.reduction.geometric_stiffness.room_for_stiffness import left_out_words, makes_stiffness
    from cms.reduction.geometric_stiffness.unit_states import has_geometric_stiffness
    from cms.reduction.reduction import reduce

    is_made = states is not None or makes_stiffness(
        job.reduction.geometric_stiffness, body_of(source), len(modes.labels)
    )
    with stages("reduce"):
        made = reduce(
            source,
            modes,
            frame=frame_of(job, held=body_of(source).is_held),
            damping=None if job.damping is None else job.damping.damping,
            stress=job.reduction.stress is not False,
            quadratic=bool(job.reduction.quadratic_modes),
            geometric=is_made if states is None else states,
            recovery=requests_of(job.recovery),
        )
    left_out = ""
    if not is_made and job.reduction.geometric_stiffness is None and has_geometric_stiffness(body_of(source)):
        left_out = left_out_words(body_of(source), len(modes.labels))
    return replace(made, provenance={**made.provenance, "geometric stiffness": left_out}) if left_out else made


def with_own_factorisation(
    job: Job, coupled: FEBody, solver: Solver, stages: Stages, to_disk: bool
) -> "tuple[ModeSet, UnitStates | None]":
    """Make all results that need the factorisation, and free it, because the reduction needs the memory."""
    from cms.modes.families.families import Families

    announce = not reduces_interfaces(job)
    with Families(coupled, announce=announce, solver=solver, to_disk=to_disk) as families:
        return modes_and_states(job, families, stages)


def modes_and_states(job: Job, families: "Families", stages: Stages) -> "tuple[ModeSet, UnitStates | None]":
    """Return the mode set, and the static states of unit loads.

    The states are for the geometric stiffness; None if it is left out or unknown.
    """
    from cms.jobs.mode_set_of_job import job_mode_set, reduction_of
    from cms.reduction.geometric_stiffness.room_for_stiffness import makes_stiffness
    from cms.reduction.geometric_stiffness.unit_states import unit_states

    with stages(f"mode set {job.reduction.set}"):
        modes = job_mode_set(families, reduction_of(job, families.body))
    # if it is too large, `reduce` reports that it is left out
    wanted = makes_stiffness(job.reduction.geometric_stiffness, families.body, len(modes.labels))
    if not wanted and not job.reduction.quadratic_modes:
        return modes, None
    with stages("static states"):
        asked = job.reduction.geometric_stiffness
        return modes, unit_states(
            families,
            frame=moving_frame_of(job),
            spread=job.reduction.spread_loads is not False,
            interfaces=asked if isinstance(asked, list) else None,
        )


def reduces_interfaces(job: Job) -> bool:
    """Return whether a job requests fewer modes for interfaces of kind "nodes"."""
    return job.reduction.interface_modes is not None or job.reduction.interface_cutoff is not None


def expected_columns(job: Job, body: FEBody) -> int:
    """Return a lower bound of the number of columns of the mode set of a job, before the set is made."""
    from cms.modes.families.interface_cost import interface_reduction_size
    from cms.modes.mode_sets import INTERFACE_SETS

    found = len(body.b)
    if reduces_interfaces(job):
        found = interface_reduction_size(body, job.reduction.interface_modes or 0)
    if job.reduction.set not in INTERFACE_SETS:
        found = 0
    return found + (job.reduction.n_modes if isinstance(job.reduction.n_modes, int) else 0)


def reduction_options(job: Job, body: FEBody) -> "ReductionOptions":
    """Return what the file of a job is meant to hold.

    Parameters
    ----------
    body
        The coupled body of the job.
    """
    from cms.assessment.quality.of_reduction.contents import ReductionOptions
    from cms.jobs.tables.recovery_section import requests_of

    asked = job.reduction.geometric_stiffness
    is_made = asked is True or bool(job.reduction.quadratic_modes)
    return ReductionOptions(
        damping=None if job.damping is None else job.damping.damping,
        frame=frame_of(job, held=body.is_held),
        stress=job.reduction.stress is not False,
        geometric=tuple(asked) if isinstance(asked, list) else is_made,
        quadratic=bool(job.reduction.quadratic_modes),
        recovery=requests_of(job.recovery),
    )
