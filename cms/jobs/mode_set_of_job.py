"""Mode set, body frame and options of a reduction that a job requests, as function arguments."""

import logging
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import Job
from cms.jobs.reduction_table import AUTO, LoadSection, NeighbourSection, ReductionSection, mode_set_options
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families, families_of
from cms.modes.families.interface_loads import InterfaceLoad, condensed_load
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import INTERFACE_SETS, MODE_SETS
from cms.modes.mode_sets.characteristic_modes import with_characteristic_modes
from cms.modes.mode_sets.extra_columns import EXTRA_COLUMNS, with_modes_beyond
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import Array

if TYPE_CHECKING:
    from cms.assessment.quality.of_reduction.contents import ReductionOptions
    from cms.reduction.basis.frames import Frame, HeldFrame

__all__ = ["frame_of", "job_mode_set", "reduction_of", "reduction_options"]

log = logging.getLogger(__name__)

COUNT_KEYS = ("n_modes", "cutoff", "verify")  #: keys for the number of modes


def job_mode_set(body: FEBody | Families, reduction: ReductionSection) -> ModeSet:
    """Compute the mode set that the table [reduction] requests for a coupled body.

    Parameters
    ----------
    body
        A coupled body, or its `Families`.
    reduction
        Table of the job.

    Raises
    ------
    CmsError, FeModelsError
        If the set cannot be made with these options, or a neighbour cannot be read.
    """
    with families_of(body) as families:
        body = families.body
        options = set_options(body, reduction)
        added = partial(with_additions, families, reduction)
        make, n_modes = partial(MODE_SETS[reduction.set], families), reduction.n_modes
        n_beyond = reduction.beyond or 0 if reduction.set in (*INTERFACE_SETS, "normal") else 0
        if n_beyond and isinstance(n_modes, int):  # the families keep them, and the set takes its own
            make(**{**options, "n_modes": min(n_modes + n_beyond, max(n_modes, most_modes(body)))})
        if n_modes != AUTO:
            modes = added(make(**options))
        else:
            from cms.assessment.compare.mode_selection import select_modes

            has_additions = reduction.extra or reduction.reduces_interfaces
            modes = select_modes(
                families,
                set=reduction.set,
                error=reduction.error or 0.0,
                band=reduction.band or (0.0, 0.0),
                measure=reduction.measure or "frequency",
                options=options,
                added=added if has_additions else None,
            ).modes
        if not n_beyond or modes.is_static.all():
            return modes
        n = int(np.count_nonzero(~modes.is_static))
        more = make(**{**options, "n_modes": min(n + n_beyond, max(n, most_modes(body)))})
        return with_modes_beyond(modes, more)


def most_modes(body: FEBody) -> int:
    """Return the number of interior dofs; each multiplier of a distributing interface reduces them by one."""
    return body.n_dof - len(body.b) - 2 * int((body.dofs[:, 1] == MULTIPLIER).sum())


def reduction_of(job: Job, body: FEBody) -> ReductionSection:
    """Return the table [reduction]; for a part of a body, its number of modes is limited to the possible number.

    The jobs of all parts of a body have the same number of modes, but a small part may have fewer interior dofs.
    """
    asked = job.reduction.n_modes
    if job.body.part is None or not isinstance(asked, int) or asked <= (n_i := most_modes(body)):
        return job.reduction
    log.warning(
        "part %d of the body: n_modes = %d, but it has %d interior dofs: it is reduced with %d modes",
        job.body.part.number, asked, n_i, n_i,
    )  # fmt: skip
    return job.reduction.model_copy(update={"n_modes": n_i})


def with_additions(families: Families, reduction: ReductionSection, modes: ModeSet) -> ModeSet:
    """Reduce interfaces of kind "nodes" to characteristic modes, and add extra columns, as the job requests."""
    if reduction.reduces_interfaces:
        cutoff = None if reduction.interface_cutoff is None else reduction.interface_cutoff * families.body.units.time
        wanted = ModeCount(reduction.interface_modes, cutoff)
        modes = with_characteristic_modes(modes, families.body, wanted, together=bool(reduction.interfaces_together))
    for name in reduction.extra or ():
        modes = EXTRA_COLUMNS[name](modes, families)
    return modes


def set_options(body: FEBody, reduction: ReductionSection) -> dict[str, Any]:
    """Return the options of the set as function arguments, with frequencies in cycles per time unit of the body."""
    options: dict[str, Any] = {}
    time = body.units.time
    is_auto = reduction.n_modes == AUTO
    for key in mode_set_options(reduction.set):
        value = getattr(reduction, key)
        if value is None or key in COUNT_KEYS or (is_auto and key == "band"):
            continue
        if key in ("shifts", "band"):
            options[key] = tuple(x * time for x in value)
        elif key == "loads":
            made = [load_of(name, section) for name, section in value.items()]
            options["loads"] = [*options.get("loads", []), *made]
        elif key == "neighbours":
            options["loads"] = [*options.get("loads", []), *(neighbour_load(body, section) for section in value)]
        else:
            options[key] = value
    if not is_auto and (reduction.n_modes is not None or reduction.cutoff is not None):
        number = None if reduction.n_modes is None else int(reduction.n_modes)
        cutoff = None if reduction.cutoff is None else reduction.cutoff * time
        is_plain = cutoff is None and not reduction.verify
        options["n_modes"] = number if is_plain else ModeCount(number, cutoff, bool(reduction.verify))
    return options


def load_of(name: str, section: LoadSection) -> InterfaceLoad:
    """Return the neighbour load on one interface."""
    return InterfaceLoad(
        (name,), _matrix(section.mass, section.inertia), _matrix(section.stiffness, section.rotational_stiffness)
    )


def neighbour_load(body: FEBody, section: NeighbourSection) -> InterfaceLoad:
    """Build the body of the neighbour's job, and condense it to the shared interfaces."""
    from cms.jobs.body_of_job import job_body
    from cms.jobs.job import read_job

    job = read_job(section.job)
    neighbour = job_body(job)
    if neighbour.units != body.units:
        raise JobError(
            f"{section.job}: the neighbour is in units {neighbour.units.name}, body {body.name!r} in "
            f"{body.units.name}; give both the same units"
        )
    return condensed_load(neighbour, section.interfaces)


def _matrix(translation: tuple[tuple[float, ...], ...] | None, rotation: tuple[float, ...] | None) -> Array:
    if translation is not None and len(translation) == 6:
        return np.array(translation)
    first = (0.0, 0.0, 0.0) if translation is None else translation[0]
    return np.diag([*first, *(rotation or (0.0, 0.0, 0.0))])


# body frame and other options of the reduction ------------------------------------------------------------------------


def frame_of(job: Job, *, held: bool = False) -> "Frame | HeldFrame":
    """Return the body frame of the job; for a fixed body, only the ground is allowed."""
    from cms.reduction.basis.frames import FRAMES, HeldFrame, NodalFrame

    reduction = job.reduction
    if held:
        if "frame" in reduction.model_fields_set:
            raise JobError(
                f'reduction.frame = "{reduction.frame}": body {job.body.name!r} is held to the ground, as it was '
                "said; its frame is the ground: remove frame"
            )
        return HeldFrame(reduction.origin, reduction.axes)
    if reduction.frame == "nodal":
        return NodalFrame(reduction.at, reduction.origin, reduction.axes, reduction.dofs)
    return FRAMES[reduction.frame](origin=reduction.origin, axes=reduction.axes)


def reduction_options(job: Job, body: FEBody) -> "ReductionOptions":
    """Return the options that determine the expected content of the modal file.

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
