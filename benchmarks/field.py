"""Benchmark problems of the field: rigid mechanisms of the IFToMM library, flexible beams of Bauchau and others (2016).

    python -m benchmarks.field                 # all, some minutes
    python -m benchmarks.field --short         # under a minute
    python -m benchmarks.field --pictures docs # the pictures of docs/field_benchmarks.md too

Processor time of a motion with its kernels compiled; published times stand beside with their machines, which are other
ones. Errors against exact solutions, other equations (tests/references) and what others have published.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.special import ellipj, ellipk

from benchmarks.field_beams import Describe, exact, marker_of, parts, path, segments, superelements
from floatframe import GeneralizedAlpha, System, Trajectory, integrate, static_equilibrium
from floatframe.analyses import snapshot
from floatframe.components.mechanisms import (
    andrews_mechanism,
    bricard_mechanism,
    buckling_beam,
    flyball_governor,
    loaded_cantilever,
    misaligned_four_bar,
    n_four_bar,
    point_pendulum,
    unbalanced_shaft,
)
from floatframe.components.mechanisms.beam_benchmarks import (
    BUCKLING_LINES,
    FOUR_BAR_LINES,
    PRINCETON_LINE,
    SHAFT_LINE,
    crank_turn,
    shaft_turn,
)
from floatframe.errors import FloatframeError
from floatframe.model.functions.time_functions import TimeFunction, cycloidal_spin_up
from floatframe.results.energy_balance import balance_defect
from floatframe.results.place_motion import point_motion
from tests.references.cosserat_rod import Section, cantilever, four_bar
from tests.references.field_oracles import ANDREWS_END, andrews_angles, bricard, four_bar_angle, governor

FORMULATIONS = ("absolute", "relative")
X = np.array([1.0, 0.0, 0.0])

#: published seconds of the problems as the library has them now, with program and machine (docs/field_benchmarks.md)
PUBLISHED = {
    "A01": "OpenSim 3.2 0.637 s (i5-4570); exudyn 0.037 s (i7 of a laptop)",
    "A02": "OpenSim 3.2 0.455 s (i5-4570); exudyn 0.078 s (i9, drift 0.11 J)",
    "A03": "OpenSim 3.2 0.384 s (i5-4570)",
    "A04": "OpenSim 3.2 0.258 s (i5-4570)",
    "A05": "exudyn 0.53 to 0.67 s (tree of joints, 0.5 ms)",
}
#: published places of the Princeton beam's end: beam elements of ANSYS (Obrezkov and others 2022), ANCF of exudyn [m]
LOADS = {8.896: "P2", 13.345: "P3"}
ANGLES = (0, 15, 30, 45, 60, 75, 90)
ANSYS = {
    8.896: (
        (1.071417630e-2, 1.061328706e-2, 1.011169630e-2, 8.837226265e-3, 6.604665004e-3, 3.538889001e-3, 0.0),
        (0.0, 4.208232124e-2, 7.939482948e-2, 0.108987937, 0.129887616, 0.142194370, 0.146245978),
    ),
    13.345: (
        (1.606423724e-2, 1.645825752e-2, 1.665873206e-2, 1.518618440e-2, 1.157837500e-2, 6.248967384e-3, 0.0),
        (0.0, 6.435812858e-2, 0.117735994, 0.156467239, 0.181861627, 0.196097131, 0.200677707),
    ),
}


def relative_error(found: np.ndarray, reference: np.ndarray, threshold: float = 1e-3) -> float:
    """Largest error of all outputs, each by its reference or the threshold, as the first library defined it."""
    return float((np.abs(found - reference) / np.maximum(np.abs(reference), threshold)).max())


def pendulum(t: np.ndarray) -> np.ndarray:
    """Place of the point mass of A01, (n_t, 2)."""
    sn = ellipj(ellipk(0.5) - np.sqrt(9.81) * t, 0.5)[0]
    theta = 2 * np.arcsin(np.sqrt(0.5) * sn)
    return np.column_stack([-np.sin(theta), -np.cos(theta)])


def timed(system: System, t_end: float, h: float, every: float, formulation: str) -> tuple[Trajectory, float]:
    """Return a motion with output every so many seconds and its processor time [s], the kernels being compiled."""
    method = GeneralizedAlpha(0.9)
    integrate(system, method, 5 * h, h, formulation=formulation)
    began = time.process_time()
    motion = integrate(system, method, t_end, h, output_every=max(round(every / h), 1), formulation=formulation)
    return motion, time.process_time() - began


def of_pendulum(motion: Trajectory) -> dict[str, float]:
    """Judge A01."""
    place, exact = motion.body("mass").r[:, :2], pendulum(motion.t)
    return {"place": float(np.abs(place - exact).max()), "relative": relative_error(place, exact)}


def of_windows(n: int) -> Callable[[Trajectory], dict[str, float]]:
    """Judge A02 by place and velocity of B_0."""

    def judge(motion: Trajectory) -> dict[str, float]:
        theta = four_bar_angle(n, motion.t)
        top = point_motion(motion, "crank 0", X)
        place, exact = top.position[:, :2], np.column_stack([np.cos(theta), np.sin(theta)])
        return {"place": float(np.abs(place - exact).max()), "relative": relative_error(place, exact)}

    return judge


def of_andrews(motion: Trajectory) -> dict[str, float]:
    """Judge A03: angles at 0.03 s by the test set."""
    row = int(np.argmin(np.abs(motion.t - 0.03)))
    off = np.abs(np.exp(1j * andrews_angles(motion)[row]) - np.exp(1j * ANDREWS_END))
    return {"angles at 0.03 s": float(off.max())}


def of_bricard(motion: Trajectory) -> dict[str, float]:
    """Judge A04 by the place of P_3."""
    reference = bricard(motion.t)
    place = motion.body("rod 4").r
    return {"place": float(np.abs(place - reference).max()), "relative": relative_error(place, reference)}


def of_governor(motion: Trajectory) -> dict[str, float]:
    """Judge A05 by the height of the slider."""
    height, reference = motion.body("slider").r[:, 2], governor(motion.t)
    return {"place": float(np.abs(height - reference).max()), "relative": relative_error(height, reference)}


def rigid_problems(short: bool) -> list[tuple[str, System, float, float, float, Callable]]:
    """Return problem, system, duration, step, distance of outputs and judge."""
    rows = [
        ("A01, 10 s", point_pendulum(), 10.0, 8e-4, 0.01, of_pendulum),
        ("A02, 2 windows, 10 s", n_four_bar(2), 10.0, 1e-3, 0.01, of_windows(2)),
        ("A03, 0.05 s", andrews_mechanism(), 0.05, 1e-5, 1e-4, of_andrews),
        ("A04, 10 s" if not short else "A04, 1 s", bricard_mechanism(), 1.0 if short else 10.0, 1e-3, 0.05, of_bricard),
        ("A05, 10 s", flyball_governor(), 10.0, 5e-4, 0.05, of_governor),
    ]
    if not short:
        rows += [
            ("A03 fine", andrews_mechanism(), 0.05, 1e-6, 1e-4, of_andrews),
            ("first library: A01, 2000 s", point_pendulum(x=1.0), 2000.0, 6.25e-5, 0.5, mirrored_pendulum),
            ("first library: A02, 40 windows, 20 s", n_four_bar(40), 20.0, 1e-3, 0.05, of_windows(40)),
            ("first library: A02, 40 windows, 20 s", n_four_bar(40), 20.0, 1e-4, 0.05, of_windows(40)),
        ]
    return rows


def mirrored_pendulum(motion: Trajectory) -> dict[str, float]:
    """Judge A01 as the first library had it, begun on the right."""
    place, exact = motion.body("mass").r[:, :2], pendulum(motion.t) * [-1, 1]
    return {"place": float(np.abs(place - exact).max()), "relative": relative_error(place, exact)}


def rigid(short: bool) -> dict[str, float]:
    """Print the table of rigid problems; return its figures."""
    figures: dict[str, float] = {}
    print("| problem | step | formulation | largest drift of energy | errors | processor time | published |")
    print("|---|---|---|---|---|---|---|")
    for name, system, t_end, h, every, judge in rigid_problems(short):
        for formulation in FORMULATIONS:
            try:
                motion, seconds = timed(system, t_end, h, every, formulation)
            except FloatframeError as error:
                print(f"| {name} | {1e3 * h:g} ms | {formulation} | {str(error)[:80]} | | | |", flush=True)
                continue
            errors = judge(motion)
            drift = float(np.abs(balance_defect(motion)).max())
            told = ", ".join(f"{key} {value:.1e}" for key, value in errors.items())
            key = name[:3] if name[0] == "A" and "fine" not in name else ""
            print(
                f"| {name} | {1e3 * h:g} ms | {formulation} | {drift:.1e} J | {told} | {seconds:.2f} s | "
                f"{PUBLISHED.get(key, '')} |",
                flush=True,
            )
            if key:
                figures[f"field {key} {formulation} error"] = next(iter(errors.values()))
    print()
    return figures


def twist(R: np.ndarray) -> float:
    """Turn of a section about the axis of the undeformed beam [deg]."""
    return float(np.degrees(np.arctan2(R[2, 1], R[2, 2])))


def princeton(short: bool) -> tuple[dict[str, float], dict]:
    """Print errors of the Princeton beam; return figures and what pictures show."""
    loads = (13.345,) if short else tuple(LOADS)
    angles = (45, 90) if short else ANGLES
    described = {f"{n} part{'s' if n > 1 else ''}": parts(n) for n in ((1, 4) if short else (1, 2, 4, 8))}
    described["1 part, not stiffened"] = parts(1, stiffening=False)
    described["4 parts, one function of torsion"] = parts(4, n_torsion=1)
    if not short:
        described |= {"17 segments": segments(17), "33 segments": segments(33), "16 superelements": superelements(16)}
    figures: dict[str, float] = {}
    curves: dict = {}
    ends: dict[tuple[float, int], Section] = {}
    for load in loads:
        for angle in angles:
            b = np.deg2rad(angle)
            ends[load, angle] = cantilever(PRINCETON_LINE, load * np.array([0, -np.cos(b), np.sin(b)]))
    print(
        "Princeton beam: error of the place of the end by its displacement, largest of all angles; s: one equilibrium"
    )
    print("| beam |" + "".join(f" {LOADS[load]} |" for load in loads) + " time |\n|---|" + "---|" * (len(loads) + 1))
    for name, describe in described.items():
        worst, began, count = [], time.process_time(), 0
        for load in loads:
            errors = []
            for angle in angles:
                state, place = None, None
                try:
                    for part in (0.25, 0.5, 0.75, 1.0):
                        system = loaded_cantilever(describe, load=part * load, angle=np.deg2rad(angle))
                        state = static_equilibrium(system, state).state
                        count += 1
                    marker = marker_of(describe, PRINCETON_LINE, "beam", "end")
                    place = path(snapshot(system, state), system, marker)[0] - PRINCETON_LINE.length * X
                except FloatframeError:
                    errors.append(np.inf)
                    continue
                curves[name, load, angle] = place
                true = ends[load, angle].r - PRINCETON_LINE.length * X
                errors.append(float(np.linalg.norm(place - true) / np.linalg.norm(true)))
            worst.append(max(errors))
        seconds = (time.process_time() - began) / max(count, 1)
        words = " | ".join(f"{100 * e:.3f} %" if np.isfinite(e) else "no equilibrium found" for e in worst)
        print(f"| {name} | {words} | {seconds:.2f} s |", flush=True)
        if np.isfinite(worst[-1]):
            figures[f"field princeton {name}"] = worst[-1]
    for load in () if short else loads:
        for k, angle in enumerate(angles):
            u = ends[load, angle].r
            print(
                f"  {LOADS[load]} {angle:2d} deg: shooting u_y {-u[1]:.6f} u_z {u[2]:.6f} m, twist "
                f"{twist(ends[load, angle].R):.3f} deg; ANSYS beam {ANSYS[load][0][k]:.6f} {ANSYS[load][1][k]:.6f}"
            )
    print()
    return figures, {"curves": curves, "ends": ends}


def moved(
    system: System, t_end: float, h: float, every: float, rho: float = 0.6, state=None
) -> tuple[Trajectory, float]:
    """Return a motion and its processor time [s]."""
    began = time.process_time()
    motion = integrate(system, GeneralizedAlpha(rho), t_end, h, output_every=round(every / h), state=state)
    return motion, time.process_time() - began


def compared(title: str, described: dict[str, Describe], run, error_of, heads: tuple[str, ...]) -> tuple[dict, dict]:
    """Print a table of errors against the first description; return errors and paths by name."""
    print(title)
    print("| beam | " + " | ".join(heads) + " | time |\n|---|" + "---|" * (len(heads) + 1))
    found, errors, reference = {}, {}, None
    for name, describe in described.items():
        try:
            t, r, seconds = run(describe)
        except FloatframeError as error:
            print(f"| {name} | {str(error)[:110]} |" + " |" * len(heads), flush=True)
            continue
        found[name] = t, r
        reference = r if reference is None else reference
        errors[name] = error_of(t, r, reference)
        print(f"| {name} | " + " | ".join(errors[name]) + f" | {seconds:.2f} s |", flush=True)
    print()
    return errors, found


def negative(f: TimeFunction) -> TimeFunction:
    """Return -f."""
    pieces = f.pieces.copy()
    pieces[:, :7] *= -1
    return TimeFunction(f.begins, pieces)


def misaligned(short: bool) -> tuple[dict[str, float], dict]:
    """Print errors of the four-bar with a misaligned joint."""
    t_end, h = (2.0, 4e-3) if short else (12.0, 2e-3)
    drive = cycloidal_spin_up(0.6, 0.5)
    described = {"1 part a bar": parts(1), "2 parts a bar": parts(2), "5 segments a bar": segments(5)}
    if not short:
        described |= {"9 segments a bar": segments(9), "4 superelements a bar": superelements(4)}
    fold = np.deg2rad(np.linspace(0.0, 60.0, 7) if short else np.r_[0.0:80.0:4, 80.0:100.0:0.5, 100.0:350.0:4])
    guess, rest, places = np.zeros(8), [], []
    for angle in fold:
        one = four_bar(FOUR_BAR_LINES, -angle, guess)
        guess = one.unknown if not rest else 2 * one.unknown - rest[-1] if len(rest) > 1 and not short else one.unknown
        rest.append(one.unknown)
        places.append(one.C)
        if len(rest) > 2 and not short:
            step = (fold[len(rest)] - angle) / (angle - fold[len(rest) - 2]) if len(rest) < len(fold) else 1.0
            guess = one.unknown + step * (one.unknown - rest[-2])
    table = np.array(places)
    figures: dict[str, float] = {}
    curves = {}
    print("Four-bar with a misaligned joint: place of C against rods at rest in each position (shooting), mm")
    print("| bars | out of plane, range | error where quasi-static positions were solved | time |\n|---|---|---|---|")
    for name, describe in described.items():
        system = misaligned_four_bar(describe, turn=negative(drive))
        try:
            motion, seconds = moved(system, t_end, h, 0.02, 0.3)
        except FloatframeError as error:
            print(f"| {name} | {str(error)[:110]} | | |")
            continue
        C = path(motion, system, marker_of(describe, FOUR_BAR_LINES[1], "bar 2", "end"))
        angle = np.array([drive(x) for x in motion.t])
        at = np.array([np.interp(fold, angle, C[:, j]) for j in range(3)]).T[fold <= angle[-1]]
        error = np.abs(at - table[: len(at)]).max(axis=0)
        curves[name] = angle, C
        print(
            f"| {name} | {1e3 * C[:, 2].min():.4f} to {1e3 * C[:, 2].max():.4f} | "
            f"in plane {1e3 * error[:2].max():.4f}, "
            f"out of it {1e3 * error[2]:.4f} | {seconds:.2f} s |",
            flush=True,
        )
        figures[f"field four-bar {name}"] = float(error[2])
    print()
    return figures, {"curves": curves, "fold": fold, "table": table}


def shaft(short: bool) -> tuple[dict[str, float], dict]:
    """Print errors of the shaft through its critical speed."""
    t_end = 1.25 if short else 2.5
    described = {"exact beam, 64 elements": exact(64)} if not short else {"exact beam, 32 elements": exact(32)}
    if not short:
        described["exact beam, 32 elements"] = exact(32)
    described |= {"2 parts": parts(2), "4 parts": parts(4)}
    if not short:
        described |= {
            "2 parts, not stiffened": parts(2, stiffening=False),
            "17 segments": segments(17),
            "33 segments": segments(33),
            "16 superelements": superelements(16),
        }

    def run(describe: Describe):
        system = unbalanced_shaft(describe, turn=shaft_turn())
        start = static_equilibrium(system).state
        motion, seconds = moved(system, t_end, 1e-3 if short else 5e-4, 1e-3, state=start)
        return motion.t, path(motion, system, marker_of(describe, SHAFT_LINE, "shaft", "middle")), seconds

    figures: dict[str, float] = {}

    def error_of(t: np.ndarray, r: np.ndarray, reference: np.ndarray) -> tuple[str, ...]:
        off = np.linalg.norm((r - reference)[:, 1:], axis=1) / np.linalg.norm(reference[:, 1:], axis=1).max()
        figures[f"field shaft {len(figures)}"] = float(off[t <= 1.25].max())
        largest = 1e3 * np.linalg.norm(r[:, 1:], axis=1).max()
        return f"{largest:.2f} mm", f"{100 * off[t <= 1.25].max():.2f} %", f"{100 * off.max():.2f} %"

    title = "Shaft through its critical speed: deflection of the middle"
    errors, curves = compared(title, described, run, error_of, ("largest", "error to 1.25 s", "error to the end"))
    return {f"field shaft {k}": v for k, v in zip(errors, figures.values(), strict=True)}, curves


def buckling(short: bool) -> tuple[dict[str, float], dict]:
    """Print errors of the lateral buckling of a thin beam."""
    t_end, h = (0.2, 5e-4) if short else (0.5, 2.5e-4)
    described = {"exact beam, 32 elements": exact(32)} if short else {"exact beam, 64 elements": exact(64)}
    if not short:
        described["exact beam, 32 elements"] = exact(32)
    described |= {f"{n} parts": parts(n) for n in ((4,) if short else (2, 4, 8, 16))}
    described |= {f"{n} segments": segments(n) for n in ((17,) if short else (17, 33))}
    if not short:
        described["4 parts, one function of torsion"] = parts(4, n_torsion=1)
        described["4 parts, not stiffened"] = parts(4, stiffening=False)
        described["16 superelements"] = superelements(16)

    def run(describe: Describe):
        system = buckling_beam(describe, turn=crank_turn())
        motion, seconds = moved(system, t_end, h, 5e-4)
        return motion.t, path(motion, system, marker_of(describe, BUCKLING_LINES[0], "beam", "middle")), seconds

    figures: dict[str, float] = {}

    def error_of(t: np.ndarray, r: np.ndarray, reference: np.ndarray) -> tuple[str, ...]:
        side = np.abs(r[:, 1])
        when = 1e3 * t[np.argmax(side > 0.01)]
        first = 1e3 * t[np.argmax(np.abs(reference[:, 1]) > 0.01)]
        size = side.max() / np.abs(reference[:, 1]).max() - 1
        off = np.abs((r - reference)[:, 1]).max() / np.abs(reference[:, 1]).max()
        figures[f"field buckling {len(figures)}"] = abs(when / first - 1)
        return f"{when:.1f} ms", f"{1e3 * side.max():.2f} mm", f"{100 * size:+.2f} %", f"{100 * off:.0f} %"

    title = "Lateral buckling: the middle goes sideways by 10 mm at, at most by, and the whole motion differs by"
    errors, curves = compared(title, described, run, error_of, ("10 mm at", "largest", "error of it", "of the motion"))
    return {f"field buckling {k}": v for k, v in zip(errors, figures.values(), strict=True)}, curves


def figures(short: bool = True) -> dict[str, float]:
    """Return errors of all problems, smaller is better."""
    found = rigid(short)
    for problem in (princeton, misaligned, shaft, buckling):
        found |= problem(short)[0]
    return found


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="fewer cases, under a minute")
    parser.add_argument("--only", choices=("rigid", "princeton", "misaligned", "shaft", "buckling"))
    parser.add_argument("--pictures", type=Path, help="folder for pictures of the beams")
    asked = parser.parse_args()
    if asked.only in (None, "rigid"):
        rigid(asked.short)
    found = {}
    for problem in (princeton, misaligned, shaft, buckling):
        if asked.only in (None, problem.__name__):
            found[problem.__name__] = problem(asked.short)[1]
    if asked.pictures is not None:
        from benchmarks.field_pictures import draw

        draw(found, asked.pictures)


if __name__ == "__main__":
    main()
