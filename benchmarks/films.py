"""Ten seconds of film and a page in 3D of machines: time and size, `python -m benchmarks.films`.

Machines: the corner of the vehicle tutorial, whose transparent boxes fill the picture, the kart, and the railway
engine in its S-curve, with 48 000 triangles that deform. Films have 250 frames of 960 pixels, H.264 and GIF. Times are
those of the clock and of the processor, in all processes that draw and encode. Motions are computed before.
"""

import logging
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cms
import floatframe as ff
from benchmarks.machines import prepared
from floatframe.files.system_file.read_system import read_system
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.pictures.animation import animate, bodies_of
from tests.docs.tutorials import blocks

SECONDS = 10.0  #: length of a film [s]
MACHINES = (("kart", ("chassis",), "kart"), ("railway-engine", ("carbody",), "s_curve"))


def corner(folder: Path) -> Path:
    """Write the files of the vehicle tutorial and reduce its arm; return the system file."""
    place = folder / "corner"
    place.mkdir()
    for name, language, content in blocks("tutorial_vehicle"):
        if name and language in ("text", "toml"):
            (place / name).write_text(content, encoding="utf-8")
    cms.write(cms.reduce_job(place / "arm.toml"), place / "arm.h5")
    return place / "corner.toml"


def taken(work: Callable[[], Any]) -> tuple[float, float]:
    """Return the seconds of the clock and of the processor that work takes, those of its processes among them."""
    begin, used = time.perf_counter(), processor_time()
    work()
    return time.perf_counter() - begin, processor_time() - used


def processor_time() -> float:
    """Return the processor time of this process and of those that it started and that have ended [s]."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in both)


def shown(path: Path) -> dict[str, float]:
    """Return times and sizes of films and the page of a system's run."""
    system, run = read_system(path)
    assert run is not None
    motion = ff.integrate(
        system, run.integrator, run.t_end, run.h, state=run.start_state(system), output_every=run.output_every
    )
    boxes = {body.name: body for body in system.bodies if isinstance(body, RigidBody)}
    bodies = {**bodies_of(motion, system), **boxes}
    speed = float(motion.t[-1] - motion.t[0]) / SECONDS
    told = {}
    for words, name, work in (
        ("film of", "film.mp4", lambda out: animate(motion, bodies, out, speed=speed, system=system)),
        ("GIF of", "film.gif", lambda out: animate(motion, bodies, out, speed=speed, system=system)),
        ("page of", "page.html", lambda out: ff.view(motion, out, system=system)),
    ):
        out = path.parent / name
        clock, processor = taken(lambda out=out, work=work: work(out))
        told[f"{words} {path.stem} [s]"] = clock
        told[f"{words} {path.stem}, processor time [s]"] = processor
        told[f"{words} {path.stem} [MB]"] = out.stat().st_size / 1e6
    return told


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = [corner(folder)]
        for machine, jobs, system in () if short else MACHINES:
            paths.append(prepared(machine, jobs, folder) / f"{system}.toml")
        return {key: value for path in paths for key, value in shown(path).items()}


if __name__ == "__main__":
    for figure, value in figures(short=False).items():
        print(f"{figure}: {value:.3g}")
