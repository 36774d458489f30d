"""Kills: a run ended by SIGKILL at a random moment is readable, and resumed it is the run that was never killed."""

import logging
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaign.systems import SYSTEM
from tests.campaign.verdict import ACCEPTED, WRONG, Verdict

__all__ = ["N_SYSTEMS", "kill_case"]

N_SYSTEMS = 2
T_END = 4.0
_whole: dict[int, Any] = {}


def system_of(number: int) -> Any:
    """Return the rigid system of the campaign, or one with a flexible body on a spherical joint."""
    if number == 0:
        from floatframe.files.system_file.read_system import read_system

        path = Path(os.environ.get("TMPDIR", "/tmp")) / f"campaign-{os.getpid()}.toml"
        path.write_text(SYSTEM)
        try:
            return read_system(path)[0]
        finally:
            path.unlink()
    from tests.floatframe.simulation.examples import swing

    return swing()


def kill_case(seed: int, folder: Path) -> Verdict:
    """Kill a run in a forked process, look at what it left, go on with it, and compare bit for bit."""
    import floatframe.simulation.integrate as integration
    from floatframe import GeneralizedAlpha, integrate, read_results
    from floatframe.simulation import resume

    integration.SEGMENT_SECONDS = 0.0
    logging.getLogger("floatframe").setLevel(logging.ERROR)  # notes on the range of linear frames, a hundred times
    rng, method, number = np.random.default_rng([8, seed]), GeneralizedAlpha(0.8), seed % N_SYSTEMS
    if number not in _whole:
        begun = time.monotonic()
        path = folder / "whole.h5"
        integrate(system_of(number), method, T_END, 1e-3, output=path, output_every=7)
        _whole[number] = (read_all(read_results(path)), time.monotonic() - begun, system_of(number))
    whole, seconds, system = _whole[number]
    path = folder / "run.h5"
    child = os.fork()
    if child == 0:
        try:
            integrate(system, method, T_END, 1e-3, output=path, output_every=7)
        finally:
            os._exit(0)
    time.sleep(rng.uniform(0, 1.1 * seconds))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    had_begun = any((folder / "run.h5.segments").glob("[0-9]*.h5"))
    if path.exists() and had_begun:  # between the last two steps: the file is in its place, the folder still there
        if differing(whole, read_all(read_results(path))):
            return Verdict(WRONG, "the file that was moved into place is not the motion")
        state, motion = "killed before the folder was removed", resume(system, path)
    elif path.exists():
        state, motion = "ended before", read_results(path)
    elif had_begun:
        left = read_results(path)
        rows = left.source.read("q")
        if not np.array_equal(rows, whole["q"][: len(rows)]):
            return Verdict(WRONG, f"what the kill left is not the beginning of the motion ({len(rows)} rows)")
        state, motion = f"killed after {len(rows)} rows", resume(system, path)
    else:
        state = "killed before the first segment"
        motion = integrate(system, method, T_END, 1e-3, output=path, output_every=7)
    names = differing(whole, read_all(motion))
    if names:
        return Verdict(WRONG, f"{state}: {', '.join(names)} differ from the motion never killed")
    left_behind = sorted(each.name for each in folder.iterdir() if each.name.startswith("run"))
    return Verdict(ACCEPTED, state) if left_behind == ["run.h5"] else Verdict(WRONG, f"left behind: {left_behind}")


def differing(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> list[str]:
    """Return the names of arrays that differ in a bit."""
    return [name for name in one if not np.array_equal(one[name], other[name])]


def read_all(motion: Any) -> dict[str, np.ndarray]:
    """Return all arrays of a motion."""
    from floatframe.results.results_file import DATASETS

    return {name: motion.source.read(name) for name in DATASETS}
