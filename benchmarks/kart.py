"""The kart: yaw-rate gain, radius, wheel loads and cost over speed, with a rigid and a flexible chassis.

python -m benchmarks.kart [--steer=ANGLE] [speeds ...]
"""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import cms
import floatframe as ff
from floatframe.machines import copy_machine
from floatframe.machines.kart import Kart, chassis_tables
from floatframe.machines.kart.figures import torsion_stiffness, turn_of

#: what the frame is without, as the end of a job that extends chassis.toml
WITHOUT = {
    "engine": "masses.engine = {}\n",
    "axle": 'sections."{name}".repeat = [{name = "tube", lines = "TUBE", radius = 0.016, wall = 0.002}, '
    '{name = "bracket", lines = "BRACKET", radius = 0.020, wall = 0.004}, '
    '{name = "thin", lines = "THIN", radius = 0.009, wall = 0.0015}]\n'
    'springs."bearing_{side}" = {}\ninterfaces."rear_{side}" = {}\n',
}
METHOD, STEP = ff.GeneralizedAlpha(0.8, 1e-7), 2e-3


def main(speeds: list[float], steer: float) -> None:
    """Print a row for each speed and chassis."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("kart", folder)
        for missing in (("engine", "axle"), ("axle",), ("engine",), ()):
            for file, text in chassis_tables(Kart(), has_axle="axle" not in missing).items():
                (folder / file).write_text(text)
            (folder / "frame.toml").write_text(
                'extends = "chassis.toml"\n' + "".join(WITHOUT[each] for each in missing)
            )
            chassis = cms.reduce_job(folder / "frame.toml")
            hertz = ", ".join(f"{f:.1f}" for f in chassis.free_frequencies[:4])
            words = f"without {' and '.join(missing)}" if missing else "complete"
            print(f"chassis {words}: {chassis.moments.gram[0, 0]:.2f} kg, free modes {hertz} Hz")
        print(f"torsion {torsion_stiffness(chassis):.0f} N m/rad")
        cms.write(chassis, folder / "chassis.h5")
        for speed in speeds:
            for is_rigid in (True, False):
                changes = {"speed": speed, "steer": steer, "is_rigid": is_rigid}
                system, options = ff.read_system(folder / "kart.toml", changes)
                assert options is not None
                begin = time.process_time()
                motion = ff.integrate(system, METHOD, options.t_end, STEP)
                cost = (time.process_time() - begin) / options.t_end
                turn = turn_of(system, motion)
                loads = ", ".join(f"{load:.0f}" for load in turn.loads[-1])
                print(
                    f"{speed:5.1f} m/s {'rigid   ' if is_rigid else 'flexible'} "
                    f"gain {turn.yaw_rate[-1] / steer:6.3f} 1/s, "
                    f"R {turn.radius:6.2f} m, a_y {turn.lateral_acceleration[-1]:6.3f} m/s², loads {loads} N, "
                    f"least rear left {turn.loads[:, 2].min():.0f} N, {cost:.2f} s per second"
                )


if __name__ == "__main__":
    steers = [float(word.removeprefix("--steer=")) for word in sys.argv[1:] if word.startswith("--steer=")]
    given = [float(word) for word in sys.argv[1:] if not word.startswith("--")]
    main(given or [3.0, 6.0, 9.0, 12.0, 15.0], *(steers or [0.082]))
