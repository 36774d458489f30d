"""The railway vehicle over speed: least damping, stable limit cycle, and the bracket of the unstable one.

python -m benchmarks.railway_stability [speeds ...]
python -m benchmarks.railway_stability --circle [radius ...]
"""

import sys
import time

import numpy as np

import floatframe as ff
from floatframe.components import rails
from floatframe.machines.bogie import RailVehicle, in_circle, steady_motion_of, vehicle
from floatframe.machines.bogie.running import lateral_modes
from floatframe.machines.bogie.unstable_branch import bracket_of_unstable_cycle, hunted

AXLE = "axle_front_leading"


def branch(speeds: list[float]) -> None:
    """Print a row for each speed, S1002 on 60E1 with FASTSIM."""
    laws = rails.ContactLaws(creep="fastsim", friction=0.4, strips=8)
    for speed in speeds:
        begin = time.process_time()
        now = hunted(vehicle(RailVehicle(), speed, laws=laws), AXLE)
        found = bracket_of_unstable_cycle(now)
        rate = f"{now.eigenvalue.real:+.3f} {now.eigenvalue.imag:+.2f}i 1/s"
        runs = [
            f"{1e3 * r.start:.2f} -> {1e3 * r.early:.2f} -> {1e3 * r.late:.2f} mm" if r else "none" for r in found[:2]
        ]
        cost = time.process_time() - begin
        print(
            f"{speed:6.2f} m/s: {rate}, dies out {runs[0]}, lasts {runs[1]}, cycle {1e3 * found.cycle:.2f} mm "
            f"({cost:.0f} s)",
            flush=True,
        )


def circles(radii: list[float], cant: float = 0.1) -> None:
    """Print trim and least damping over speed in circles with 100 mm of cant, S1002 on 60E1, linear creep."""
    laws = rails.ContactLaws(creep="kalker", friction=0.4)
    for radius in radii:
        for speed in (15.0, np.sqrt(9.81 * radius * cant / 1.5), 60.0):
            if speed**2 / radius > 2.0:
                continue
            begin = time.process_time()
            motion = steady_motion_of(in_circle(RailVehicle(), speed, radius, cant=cant, laws=laws), radius)
            linear = ff.linearize(motion.system, motion.equilibrium, inputs=(), outputs=())
            roots, modes = lateral_modes(linear)
            k = int(np.argmin(-roots.real / np.abs(roots)))
            fastest = modes.eigenvalues[np.argmax(modes.eigenvalues.real)]
            at = ff.analyses.snapshot(motion.system, motion.equilibrium).body(AXLE).r[0]
            shift = aside(at, radius, cant)
            cost = time.process_time() - begin
            print(
                f"R {radius:5.0f} m, {speed:5.1f} m/s: {motion.equilibrium.n_iterations} steps, push "
                f"{motion.found['push']:.0f} N, leading axle {1e3 * shift:+.2f} mm to the outside, least damping "
                f"{-roots[k].real / abs(roots[k]):.3f} at {roots[k].imag / (2 * np.pi):.2f} Hz, fastest growth "
                f"{fastest.real:.3g} 1/s at {fastest.imag / (2 * np.pi):.1f} Hz ({cost:.0f} s)",
                flush=True,
            )


def aside(place: np.ndarray, radius: float, cant: float) -> float:
    """Return how far a point is to the outside of the centre line, across the canted track [m]."""
    inward, up = radius - float(np.hypot(place[0], place[1] - radius)), float(place[2])
    angle = np.arcsin(cant / 1.5)
    return -float(inward * np.cos(angle) - up * np.sin(angle))


if __name__ == "__main__":
    words = [float(word) for word in sys.argv[1:] if not word.startswith("--")]
    if "--circle" in sys.argv[1:]:
        circles(words or [300.0, 600.0, 1500.0])
    else:
        branch(words or [72.0, 72.5, 73.0, 73.5, 74.0, 75.0])
