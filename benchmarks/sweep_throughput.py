"""Points of a parameter sweep by workers of every kind, beside the same runs in one warm process.

    python -m benchmarks.sweep_throughput                        # 1000 points; some ten minutes on two cores
    python -m benchmarks.sweep_throughput --points 40 --warm 10

The shipped slider-crank of `cms demo`: crank, flexible rod and slider, 800 steps a point; the mass of the slider varies
and the largest deflection of the rod is taken. A point reads the system and its modal file, runs, and is written to the
journal. Processor time is that of the command and all its workers: on a machine that others use it is the number to
look at. Each kind of workers sweeps a quarter of the points and then, started anew, all of them: the slope is the cost
of a point, the rest that of the start (processes, imports, loading of compiled code). Tables of all kinds of workers
must be the same bit for bit.
"""

import argparse
import resource
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from cms.fleet import reduce_fleet
from fe_models.foundation.threads import bounded_threads
from floatframe.design.studies.study import StudyPoint, run_study
from floatframe.design.studies.study_file import read_study
from floatframe.engine.kernels.entry import prepare

PACKAGES = Path(__file__).parents[1]
STUDY = """
system = "crank.toml"

[parameters.slider]
path = "bodies.slider.mass"
first = 1e-5
last = 3.5e-5
number = {n}

[outputs.deflection]
of = "middle size"
take = "greatest"
"""


def files(folder: Path, n: int) -> Path:
    """Write the shipped case and the study; return the path of the study."""
    data = PACKAGES / "cms" / "cli" / "data"
    shutil.copy(data / "rod.toml", folder / "rod.toml")
    (folder / "crank.toml").write_text((data / "crank.toml").read_text().replace("t_end = 0.16 ", "t_end = 0.04 "))
    shutil.copy(PACKAGES / "fe_models" / "parts" / "data" / "slender_rod.msh", folder / "rod.msh")
    reduce_fleet([folder / "rod.toml"], workers=1)
    (folder / "study.toml").write_text(STUDY.format(n=n))
    return folder / "study.toml"


def processor_seconds() -> float:
    """Return the processor time of this process and of those that it started and that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


@dataclass(frozen=True)
class Sweeps:
    """What sweeps with workers of every kind took."""

    n: int  #: points of a sweep
    warm: float  #: processor time of a run in a warm process [s]
    warm_clock: float  #: the same by the clock
    rows: list[tuple[str, float, float, float]]  #: workers; start, a point [s of processor]; the whole by the clock [s]
    is_same: bool  #: whether all tables are the same bit for bit


def measured(n_points: int, n_warm: int, kinds: list[str]) -> Sweeps:
    """Sweep with workers of every kind."""
    prepare()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = read_study(files(folder, n_points))
        points = list(study.points())
        warm = StudyPoint(study)
        warm(points[0])
        spent = wall = 0.0

        def run_warm() -> None:
            nonlocal spent, wall
            with bounded_threads(1):
                begin, before = perf_counter(), processor_seconds()
                for point in points[:n_warm]:
                    warm(point)
            spent, wall = spent + processor_seconds() - before, wall + perf_counter() - begin

        run_warm()
        rows, tables = [], {}
        (quarter,) = study.parameters
        fewer = replace(study, parameters=(replace(quarter, values=quarter.values[: len(points) // 4]),))
        for workers in kinds:
            spent_on = []
            for k, each_study in enumerate((fewer, study)):
                begin, before = perf_counter(), processor_seconds()
                table = run_study(each_study, workers=workers, journal=folder / f"{len(rows)}-{k}.journal")
                spent_on.append((len(table.rows), processor_seconds() - before))
            (n_few, few), (n_all, all_) = spent_on
            a_point = (all_ - few) / (n_all - n_few)
            rows.append((workers, all_ - n_all * a_point, a_point, perf_counter() - begin))
            tables[workers] = table.column("deflection").tobytes()
        run_warm()
    runs = 2 * min(n_warm, len(points))
    return Sweeps(len(points), spent / runs, wall / runs, rows, len(set(tables.values())) == 1)


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    found = measured(*((48, 12) if short else (1000, 50)), ["1", "2"])
    if not found.is_same:
        raise RuntimeError("tables of a sweep differ between workers")
    return {
        f"point of a sweep over a run in a warm process, workers: {workers}": a_point / found.warm
        for workers, _, a_point, _ in found.rows
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=1000, help="points of each sweep")
    parser.add_argument("--warm", type=int, default=50, help="runs in one warm process, before and after the sweeps")
    parser.add_argument("--workers", default="1,2,4", help="numbers of workers")
    parser.add_argument("--no-dask", action="store_true", help="processes alone")
    arguments = parser.parse_args()
    numbers = [int(word) for word in arguments.workers.split(",")]
    kinds = [*map(str, numbers), *([] if arguments.no_dask else [f"dask:{n}" for n in numbers])]
    found = measured(arguments.points, arguments.warm, kinds)
    each, lasts = found.warm, found.warm_clock
    print(f"one run in a warm process: {1e3 * each:.1f} ms of processor time, {1e3 * lasts:.1f} ms on the clock\n")
    print("| workers | start | a point | over a warm run | 1000 points with their start | throughput on the clock |")
    print("|---|---|---|---|---|---|")
    for workers, start, a_point, elapsed in found.rows:
        whole = (start / 1000 + a_point) / each
        speed = found.n / elapsed * lasts
        costs = f"{start:.1f} s | {1e3 * a_point:.1f} ms | {a_point / each:.2f} | {whole:.2f}"
        print(f"| {workers} | {costs} | {speed:.2f} |")
    print(f"\n{found.n} points each; tables {'the same bit for bit' if found.is_same else 'DIFFER'}")


if __name__ == "__main__":
    main()
