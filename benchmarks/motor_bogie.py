"""The bogie with induction motors: its modes, the lines of its supplies in torque and loads, the picture of its page.

python -m benchmarks.motor_bogie FOLDER [picture.png]

FOLDER holds the machine (floatframe example motor-bogie) with its results (floatframe run): their starts are read.
"""

import sys
from pathlib import Path

import numpy as np

import floatframe as ff
from floatframe.files.signals.orders import frequency_map
from floatframe.files.signals.signals import Signal
from floatframe.machines.motor_bogie import MotorBogie
from floatframe.machines.motor_bogie.closed_forms import ripple_of_leakage, speed_of_torque, torque_lines
from floatframe.machines.motor_bogie.plots import (
    at_rest,
    modes_of,
    plot_start,
    predicted_lines,
    supply_lines,
    supply_phase,
)

LOAD, COLUMN = "leading_lower", "force x"


def main(folder: Path, picture: Path | None) -> None:
    """Print modes and lines, and draw the start on an inverter."""
    data = MotorBogie()
    system, _ = ff.read_system(folder / "six_steps.toml")
    linear = at_rest(system, LOAD, COLUMN)
    modes = modes_of(linear, 5.0, 180.0)
    print("modes at rest: Hz, damping, part of their energy of motion in the modes of the frame, bodies")
    for mode in modes:
        print(f"{mode.frequency:7.2f} {100 * mode.damping:5.1f} % {mode.flexible:5.2f}  {mode.where}")
    print(
        "\nripple of the torque at 1500 N m, in even running: f, at 6 f, at 12 f, by leakage alone; at 2 f unbalanced"
    )
    for f in (3.0, 5.0, 10.0, 20.0, 60.0):
        speed = speed_of_torque(data.motor, f, 1500.0)
        six, one = torque_lines(data.motor, data.harmonics, f, speed), torque_lines(data.motor, ((-1, 0.03),), f, speed)
        print(f"{f:5.0f} Hz {six[6]:7.1f} {six[12]:7.1f} {ripple_of_leakage(data.motor, f):7.1f} {one[2]:7.1f} N m")
    for name, multiples in (("six_steps", (6, 12)), ("unbalanced", (2,)), ("sine", ())):
        path = folder / f"{name}.h5"
        if not path.is_file():
            continue
        system, _ = ff.read_system(folder / f"{name}.toml")
        motion = ff.read_results(path)
        report(name, system, motion, multiples, data)
        if picture is not None and name == "six_steps":
            draw(system, motion, multiples, data, picture)


def report(name: str, system: ff.System, motion: ff.Trajectory, multiples: tuple[int, ...], data: MotorBogie) -> None:
    """Print what a start has, and its lines beside those of even running."""
    t = np.asarray(motion.t)
    seen = ff.results.element_motion(system, motion, "leading_drive").outputs
    force = ff.sensors.measured(system, motion)[LOAD].columns[COLUMN]
    late = t > t[-1] - 1.0
    speed = motion.body("body").v[-1, 0]
    print(f"\n{name}: {speed:.2f} m/s at the end, torque {seen['torque'][late].mean():.0f} N m in the last second")
    began = t > 0.4  # the frequency of the supply rises
    print(f"  force in the mount {np.min(force[began]):.0f} to {np.max(force[began]):.0f} N since the start")
    if not multiples:
        return
    mean = float(seen["torque"][late].mean())
    used = data if name == "six_steps" else MotorBogie(harmonics=((-1, 0.03),))
    found = supply_lines(system, motion, LOAD, COLUMN, multiples=multiples)
    even = predicted_lines(used, at_rest(system, LOAD, COLUMN), found.frequency, mean, multiples)
    for n in multiples:
        k, j = int(np.argmax(found.load[n])), int(np.argmax(even.load[n]))
        print(
            f"  greatest load of {n} f: {found.load[n][k]:.0f} N at {n * found.frequency[k]:.2f} Hz, torque "
            f"{found.torque[n][k]:.0f} N m; even: {even.load[n][j]:.0f} N at {n * found.frequency[j]:.2f} Hz"
        )
    print("  f, line, torque and load of the start, of even running")
    for n in multiples:
        for k in range(0, len(found.frequency), max(1, len(found.frequency) // 25)):
            line = n * found.frequency[k]
            print(
                f"  {found.frequency[k]:6.2f} Hz {n:3d} f = {line:6.2f} Hz: {found.torque[n][k]:7.1f} N m "
                f"{found.load[n][k]:8.1f} N; {even.torque[n][k]:7.1f} N m {even.load[n][k]:8.1f} N"
            )


def draw(system: ff.System, motion: ff.Trajectory, multiples: tuple[int, ...], data: MotorBogie, path: Path) -> None:
    """Write the picture of a start."""
    t = np.asarray(motion.t)
    seen = ff.results.element_motion(system, motion, "leading_drive").outputs
    torque, n = seen["torque"], round(0.5 / (t[1] - t[0]))
    force = ff.sensors.measured(system, motion)[LOAD].columns[COLUMN]
    maps = [
        (frequency_map(Signal(title, t, np.asarray(values), unit), n_segment=n, overlap=0.95), lines)
        for title, values, unit, lines in (
            ("current of a phase of the leading motor", seen["current 1"], "A", (1, 5, 7, 11, 13)),
            ("torque in its air gap", torque, "N m", multiples),
            ("force along the track in its lower mount", force, "N", multiples),
        )
    ]
    linear = at_rest(system, LOAD, COLUMN)
    found = supply_lines(system, motion, LOAD, COLUMN, multiples=multiples)
    even = predicted_lines(
        data, linear, np.linspace(1.2, float(found.frequency.max()), 300), float(torque[t > t[-1] - 1].mean())
    )
    frequency, _ = supply_phase(system, t)
    plot_start(maps, (t, frequency), modes_of(linear, 5.0, 180.0), found, even).savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
