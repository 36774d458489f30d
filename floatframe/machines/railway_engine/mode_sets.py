"""Comparison of mode sets of the railway engine's body with its full model, for docs/railway_engine.md."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

import cms
from cms.jobs.body_of_job import job_body, shell_mesh
from cms.jobs.job import read_job
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.damping import RayleighDamping
from fe_models.body.fe_body import FEBody
from fe_models.elements.shells.shell_points import shell_points
from floatframe.design.laboratory.body_study import Loading, SetError, body_study, full_motions, lean_body, stress_rows
from floatframe.design.laboratory.suspended_body import SuspendedMotion
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.files.system_file.run_section import required_run
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.bodies.markers import Marker
from floatframe.model.forces import Bushing
from floatframe.model.system import System

__all__ = ["FREE", "MORE_SETS", "NAME", "PLACES", "SETS", "EngineStudy", "engine_loads", "engine_study"]

NAME, FREE = "carbody", ("bogie_1", "bogie_2")

#: points of the stress: name -> point next to the cell, in mesh axes [m]
PLACES = {
    "side wall over the seat": (5.0, 1.45, 1.6),
    "window corner": (7.2, 1.45, 2.0),
    "roof in the middle": (0.3, 0.3, 3.9),
    "floor beside the pivot": (5.0, 0.3, 1.2),
}

#: name -> function that makes the mode set with n vibration modes
SETS: dict[str, Callable[[Families, int], ModeSet]] = {
    "craig-bampton": lambda families, n: cms.craig_bampton(families, n_modes=n),
    "craig-bampton-ir": lambda families, n: cms.modes.craig_bampton_ir(families, n_modes=n),
    "rubin": lambda families, n: cms.rubin(families, n_modes=n),
    "attachment": lambda families, n: cms.modes.attachment(families, n_modes=n),
    "krylov": lambda families, n: cms.modes.krylov(families, n_modes=n),
    "balanced-truncation": lambda families, n: cms.modes.balanced_truncation(families, n_modes=n),
    "normal": lambda families, n: cms.modes.normal_modes(families, n_modes=n),
}

#: mode sets that span the same space as `rubin` with as many modes
MORE_SETS: dict[str, Callable[[Families, int], ModeSet]] = {
    "herting": lambda families, n: cms.modes.herting(families, n_modes=n),
    "macneal": lambda families, n: cms.modes.macneal(families, n_modes=n),
    "craig-chang": lambda families, n: cms.modes.craig_chang(families, n_modes=n),
    "dual-craig-bampton": lambda families, n: cms.modes.dual_craig_bampton(families, n_modes=n),
    "unrestrained-attachment": lambda families, n: cms.modes.unrestrained_attachment(families, n_modes=n),
}


def engine_loads(system: System) -> list[cms.modes.InterfaceLoad]:
    """Return the bushing loads on the body's interfaces for `cms.modes.benfield_hruda`, as springs to the ground."""
    loads = []
    for force in system.forces:
        if isinstance(force, Bushing) and isinstance(force.marker_b, Marker) and force.marker_b.interface is not None:
            K = np.diag(force.stiffness).tolist()
            loads.append(cms.modes.point_load(force.marker_b.interface, stiffness=K[:3], rotational_stiffness=K[3:]))
    return loads


@dataclass(frozen=True, eq=False)
class EngineStudy:
    """The motions of the full model, and the errors of every mode set."""

    full: dict[str, SuspendedMotion]
    results: tuple[SetError, ...]
    n_dof: int


def engine_study(
    files: Sequence[str | Path],
    n_modes: Sequence[int],
    *,
    sets: Sequence[str] = (*SETS, "benfield-hruda"),
    also: Sequence[tuple[str, int]] = (),
    every: int = 1,
    on_case: Callable[[SetError], None] | None = None,
) -> EngineStudy:
    """Compare mode sets with the full model in the systems of these files, which are beside carbody.toml and its .h5.

    Parameters
    ----------
    files
        System files from `write_railway_engine`; results have their names.
    n_modes
        Numbers of vibration modes to compare.
    sets
        Names in `SETS` and `MORE_SETS`, and "benfield-hruda", which is loaded with the springs of its bogies.
    also
        Further sets, each with one number of modes.
    every
        Number of steps between evaluations of the errors.

    Raises
    ------
    ModelError
        If a set has an unknown name.
    """
    body, damping, stress = _body_of(Path(files[0]).with_name("carbody.toml"))
    loadings = {}
    for path in files:
        system, given = read_system(path)
        run = required_run(given, Path(path))
        if not isinstance(run.integrator, GeneralizedAlpha):
            raise ModelError(f"{path}: run: expected scheme = 'generalized-alpha', the scheme of the full model")
        # steps without stabilisation, because the loads of the full model are in balance only as exactly as the rates
        # of the motion satisfy its equations
        plain = replace(run.integrator, stabilized=False)
        loadings[Path(path).stem] = Loading(replace(system, sensors=()), plain, run.t_end, run.h, every)
    loads = engine_loads(next(iter(loadings.values())).system)
    makers = (
        SETS | MORE_SETS | {"benfield-hruda": lambda families, n: cms.modes.benfield_hruda(families, n, loads=loads)}
    )
    wanted = [*((name, n) for name in sets for n in n_modes), *also]
    unknown = [name for name, _ in wanted if name not in makers]
    if unknown:
        raise ModelError(f"engine study: no set {unknown[0]!r}; choices: {', '.join(makers)}")
    full = full_motions(loadings, NAME, body, free=FREE, damping=damping)
    cases = [(name, makers[name], n) for name, n in wanted]
    results = body_study(loadings, NAME, body, full, cases, damping=damping, stress=stress, on_case=on_case)
    return EngineStudy(full, results, body.n_dof)


def _body_of(path: Path) -> tuple[FEBody, RayleighDamping, dict[str, sp.sparray]]:
    """Return the coupled body of a job, its damping, and the rows of the stress at `PLACES`."""
    job = read_job(path)
    damping = job.damping.damping if job.damping is not None else None
    if not isinstance(damping, RayleighDamping):
        raise ModelError(f"{path}: damping: expected alpha and beta, the only damping that the full model can have")
    body = job_body(job)
    mesh = shell_mesh(job)
    centres = mesh.nodes[mesh.cells["quad"]].mean(axis=1)
    stress = {}
    for place, point in PLACES.items():
        nearest = int(np.linalg.norm(centres - point, axis=1).argmin())
        stress[place] = stress_rows(shell_points(body, {"quad": [nearest]}))
    return lean_body(body), damping, stress
