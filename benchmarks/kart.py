"""The kart: yaw-rate gain, radius, wheel loads and cost over speed, with a rigid and a flexible chassis.

python -m benchmarks.kart [--steer=ANGLE] [speeds ...]
"""

import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cms
import floatframe as ff
from floatframe.machines.kart import Kart, chassis_files, kart_files
from floatframe.machines.kart.figures import torsion_stiffness, turn_of

METHOD, STEP = ff.GeneralizedAlpha(0.8, 1e-7), 2e-3


def main(speeds: list[float], steer: float) -> None:
    """Print a row for each speed and chassis."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for options in ({"has_engine": False, "has_axle": False}, {"has_axle": False}, {"has_engine": False}, {}):
            for file, text in chassis_files(Kart(), **options).items():
                (folder / file).write_text(text)
            chassis = cms.reduce_job(folder / "chassis.toml")
            hertz = ", ".join(f"{f:.1f}" for f in chassis.free_frequencies[:4])
            print(f"chassis {options or 'complete'}: {chassis.moments.gram[0, 0]:.2f} kg, free modes {hertz} Hz")
        print(f"torsion {torsion_stiffness(chassis):.0f} N m/rad")
        cms.write(chassis, folder / "chassis.h5")
        for speed in speeds:
            for is_rigid in (True, False):
                kart = replace(Kart(), speed=speed, steer=steer)
                (file, text), *_ = kart_files(kart, is_rigid=is_rigid).items()
                (folder / file).write_text(text)
                system, _ = ff.read_system(folder / file)
                begin = time.process_time()
                motion = ff.integrate(system, METHOD, kart.duration, STEP)
                cost = (time.process_time() - begin) / kart.duration
                turn = turn_of(system, motion)
                loads = ", ".join(f"{load:.0f}" for load in turn.loads[-1])
                print(
                    f"{speed:5.1f} m/s {'rigid   ' if is_rigid else 'flexible'} "
                    f"gain {turn.yaw_rate[-1] / kart.steer:6.3f} 1/s, "
                    f"R {turn.radius:6.2f} m, a_y {turn.lateral_acceleration[-1]:6.3f} m/s², loads {loads} N, "
                    f"least rear left {turn.loads[:, 2].min():.0f} N, {cost:.2f} s per second"
                )


if __name__ == "__main__":
    steers = [float(word.removeprefix("--steer=")) for word in sys.argv[1:] if word.startswith("--steer=")]
    given = [float(word) for word in sys.argv[1:] if not word.startswith("--")]
    main(given or [3.0, 6.0, 9.0, 12.0, 15.0], *(steers or [Kart().steer]))
