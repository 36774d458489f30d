"""What the modes of flexible bodies leave out of the motions of the ready machines: the estimate beside richer bodies.

    python -m benchmarks.left_out [MACHINE ...]           # all: about a quarter of an hour

Every flexible body of a machine is reduced as its job says, and again with `MORE` more vibration modes of the same set,
or with all. Both machines move. The strain energy of the richer bodies beside the span of the modes is the truth. The
run with the modes estimates it (`motion.left_out`). Largest energies are relative to the largest strain energy. The
bodies of the landing gear and of the flexible arm have no estimate, because their system files add masses or choose
modes.
"""

import logging
import sys
import tempfile
from pathlib import Path

import numpy as np

import cms
import floatframe as ff
from cms.errors import ModeSetError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.jobs.mode_set_of_job import frame_of, job_mode_set, reduction_of
from cms.modes.families.families import Families
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import frame_condition
from cms.reduction.reduction import reduce
from fe_models.foundation.arrays import Array
from floatframe.files.system_file.read_system import read_system
from floatframe.machines import copy_machine
from floatframe.model.bodies.flexible_body import FlexibleBody

MORE = (60, 40, 20, 10)  #: numbers of vibration modes beyond those of the job; the first that the body has is taken
#: machine, its jobs, one of its systems, seconds of motion
RUNS = (
    ("kart", ("chassis",), "kart", 1.0),
    ("bogie", ("frame",), "straight", 0.5),
    ("motor-bogie", ("frame",), "six_steps", 0.1),
    ("antenna", ("petal", "strut"), "latching", 0.4),
    ("road-car", ("body",), "lane_change", 1.0),
    ("railway-engine", ("carbody",), "s_curve", 0.5),
)
Bodies = dict[str, cms.ReducedBody]  #: reduced bodies by their jobs
Reduced = tuple[cms.ReducedBody, Array]  #: a reduced body and its shapes over the dofs, (n_dof, n_q)


def reductions(path: Path) -> tuple[Array, Reduced, Reduced]:
    """Return the stiffness over the dofs, and the body of a job with its own modes and with more."""
    job = read_job(path)
    body = job_body(job)
    condition = frame_condition(body, frame_of(job))
    damping = None if job.damping is None else job.damping.damping

    def made(families: Families, more: int) -> Reduced:
        own = job.reduction
        section = own.model_copy(update={"n_modes": own.n_modes + more})
        changed = job.model_copy(update={"reduction": section})
        modes = job_mode_set(families, reduction_of(changed, body))
        reduced = reduce(families, modes, frame=frame_of(job), damping=damping, errors=more == 0)
        return reduced, finish(body, modes, condition).Phi

    with Families(body) as families:
        own = made(families, 0)
        for more in MORE:
            try:
                return body.K, own, made(families, more)
            except ModeSetError as error:
                reason = error
        raise reason


def motion_in(machine: str, folder: Path, system: tuple[str, float], bodies: Bodies) -> ff.results.Motion:
    """Return the motion of a machine with these modal files, in a new folder."""
    copy_machine(machine, folder)
    system_name, t = system
    for name, reduced in bodies.items():
        cms.write(reduced, folder / f"{name}.h5")
    system, run = read_system(folder / f"{system_name}.toml")
    assert run is not None
    steps = max(1, round(t / run.h))
    return ff.integrate(system, run.integrator, steps * run.h, run.h, state=run.start_state(system))


def compare(machine: str, jobs: tuple[str, ...], system_name: str, t: float) -> list[str]:
    """Return a row for each flexible body of a machine."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine(machine, folder / "jobs")
        made = {job: reductions(folder / "jobs" / f"{job}.toml") for job in jobs}
        rich_bodies = {job: rich[0] for job, (_, _, rich) in made.items()}
        whole = motion_in(machine, folder / "rich", (system_name, t), rich_bodies)
        motion = motion_in(
            machine, folder / "own", (system_name, t), {job: own[0] for job, (_, own, _) in made.items()}
        )
        rows = []
        for body in motion.system.bodies:
            if not isinstance(body, FlexibleBody) or body.name not in motion.left_out:
                continue
            K, (_, Phi), (rich, Phi_rich) = made[Path(body.source).stem]
            factors = np.linalg.solve(Phi.T @ (K @ Phi), Phi.T @ (K @ Phi_rich))
            beside = Phi_rich - Phi @ factors
            q = whole.body(body.name).q
            true, strain = (((q @ (S.T @ (K @ S))) * q).sum(axis=1) / 2 for S in (beside, Phi_rich))
            found = motion.left_out[body.name]
            ratio, mean = found.energy.max() / true.max(), found.energy.mean() / true.mean()
            rows.append(
                f"| {machine}, {system_name} | {body.name} | {Phi.shape[1]} of {rich.n_q} | "
                f"{100 * true.max() / strain.max():.2g} % | {100 * found.share:.2g} % | {ratio:.2f} | {mean:.2f} |"
            )
        return rows


def main() -> None:
    """Print the table."""
    logging.disable(logging.WARNING)
    wanted = sys.argv[1:]
    print("| machine, system | body | modes | left out | estimate | ratio of the largest | of the means |")
    print("|---|---|---|---|---|---|---|")
    for run in RUNS:
        if not wanted or run[0] in wanted:
            print("\n".join(compare(*run)), flush=True)


if __name__ == "__main__":
    main()
