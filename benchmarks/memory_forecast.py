"""The forecast of memory beside what a reduction took: `cms reduce --memory`, a process each.

    python -m benchmarks.memory_forecast                    # rods of 50k and 160k dofs
    python -m benchmarks.memory_forecast 300k 475k          # larger ones; 1M and 2M (12 minutes) too
    python -m benchmarks.memory_forecast interfaces         # the body of benchmarks.interface_rich, 2043 boundary dofs
    python -m benchmarks.memory_forecast 160k 1.8GB         # with a budget, here one that takes the factor to disk
    python -m benchmarks.memory_forecast 160k threads=2     # of BLAS and of our own loops

Connecting rods of `benchmarks.large_solid`, tet10, two rigid interfaces, 50 modes, stress, no geometric stiffness.
"peak" is the largest resident size of the process; each stage has its own beside its forecast.
"""

import logging
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from benchmarks.records import print_record, record_in
from benchmarks.rods import OUT, rod_file

RODS = {"50k": 3.76, "160k": 2.44, "300k": 1.91, "475k": 1.62, "1M": 1.24, "2M": 0.972}  #: element size [mm]
AMPLE = "22GB"  #: a budget that keeps all in core
EVERY = 0.002  #: s between two looks at the resident size


def mesh_file(name):
    """Return the mesh of a rod, made once."""
    return rod_file(name, RODS[name])


def job_file(name, folder):
    """Write the job of a body."""
    if name not in RODS:
        from benchmarks.interface_rich import job_file as rich

        return rich("small" if name == "interfaces-small" else "full", "stress", folder)
    path = Path(folder) / "job.toml"
    ends = "".join(f'[interfaces.{end}]\nkind = "rigid"\nfaces = "{end}"\n' for end in ("big_end", "small_end"))
    path.write_text(
        f'[body]\nname = "rod"\nunits = "mm-t-s"\nmesh = "{mesh_file(name).resolve()}"\n'
        f"[materials.steel]\nyoung = 210e3\npoisson = 0.3\ndensity = 7.85e-9\n{ends}"
        '[reduction]\nset = "craig-bampton"\nn_modes = 50\ngeometric_stiffness = false\n'
    )
    return path


class Watched:
    """Stages that note the largest resident size of each."""

    def __init__(self):
        from cms.linear_algebra.memory.size import resident_bytes
        from fe_models.foundation.stages import Stages

        self.peaks, self._resident, self._stage = {}, resident_bytes, "start"
        self.stages = Stages(self)
        threading.Thread(target=self._look, daemon=True).start()

    def add_task(self, name, total=None):
        """Note that a stage begins."""
        self._stage = name

    def update(self, task, total=None, completed=None):
        """Take how far it is."""

    def _look(self):
        pause = threading.Event()
        while not pause.wait(EVERY):
            self.peaks[self._stage] = max(self.peaks.get(self._stage, 0.0), self._resident())


def run(job, budget, folder):
    """Reduce and write in this process; the record of it."""
    import cms
    from cms.linear_algebra.memory import budget as forecasts

    logging.basicConfig(level=logging.INFO, format="%(message)s")
    made = []
    peak_of = forecasts.peak_of

    def told(*arguments, on_disk):
        made.append((on_disk, peak_of(*arguments, on_disk=on_disk)))
        return made[-1][1]

    forecasts.peak_of = told
    watched = Watched()
    body = cms.reduce_job(job, watched.stages, memory=budget)
    with watched.stages("write"):
        cms.write(body, Path(folder) / "made.h5")
    on_disk = "on disk" in body.provenance["mode set solver"]
    peak = next(each for disk, each in reversed(made) if disk == on_disk)
    return {
        "n_dof": body.provenance["full dofs"], "n_q": body.n_q, "on disk": on_disk, "peaks": watched.peaks,
        "forecast": {name: float(getattr(peak, name)) for name in (*peak.__dataclass_fields__, "most")},
        "file": (Path(folder) / "made.h5").stat().st_size,
        "seconds": watched.stages.seconds,
    }  # fmt: skip


def measured(name, budget=AMPLE, threads=1):
    """Return the record of a reduction in a process of its own, its peak among it."""
    OUT.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=OUT) as folder, tempfile.TemporaryFile("w+", dir=OUT) as output:
        job = job_file(name, folder)
        arguments = [sys.executable, "-m", "benchmarks.memory_forecast", "run", str(job), budget, folder]
        environment = os.environ | {
            each: str(threads) for each in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        }
        child = subprocess.Popen(arguments, stdout=output, stderr=subprocess.STDOUT, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = output.read()
    if child.returncode:
        raise RuntimeError(said[-1500:])
    record = record_in(said)
    record["peak"] = usage.ru_maxrss * 1024
    record["cpu"] = usage.ru_utime + usage.ru_stime
    record["threads"] = threads
    return record


def line_of(name, record):
    """Return a record in words."""
    forecast = record["forecast"]
    parts = ", ".join(f"{stage} {size / 1e9:.2f}" for stage, size in forecast.items() if stage != "most")
    stages = ", ".join(f"{stage} {size / 1e9:.2f}" for stage, size in record["peaks"].items())
    return (
        f"{name:10} {record['n_dof']} dofs, {record['n_q']} modes, {record['threads']} threads, factor on "
        f"{'disk' if record['on disk'] else 'core'}: forecast {forecast['most'] / 1e9:.2f} GB, peak "
        f"{record['peak'] / 1e9:.2f} GB, forecast / peak {forecast['most'] / record['peak']:.2f}, file "
        f"{record['file'] / 1e6:.0f} MB, {sum(record['seconds'].values()):.0f} s, cpu {record['cpu']:.0f} s\n"
        f"           forecast [GB]: {parts}\n           peaks [GB]: {stages}"
    )


def figures(short):
    """Return what the watch keeps: how far the forecast is from the peak, either way."""
    found = {}
    for name in ("50k", "interfaces-small") if short else ("160k", "475k", "interfaces"):
        record = measured(name)
        ratio = record["forecast"]["most"] / record["peak"]
        found[f"forecast of memory and peak, the larger by the smaller, {name}"] = max(ratio, 1 / ratio)
    return found


def main():
    names = [each for each in sys.argv[1:] if each in RODS or each.startswith("interfaces")]
    budget = next((each for each in sys.argv[1:] if each.endswith("B")), AMPLE)
    threads = next((int(each[8:]) for each in sys.argv[1:] if each.startswith("threads=")), 1)
    for name in names or ["50k", "160k"]:
        print(line_of(name, measured(name, budget, threads)), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        print_record(run(*sys.argv[2:]))
    else:
        main()
