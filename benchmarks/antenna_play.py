"""The fine antenna with ideal hinges and with play: size, latching, forces, where its petals point afterwards.

python -m benchmarks.antenna_play [seconds of motion, 4.5]

Twice 4500 steps of about 1400 equations: some minutes.
"""

import logging
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import cms
import floatframe as ff
from floatframe.engine.compiling.system import compiled_system
from floatframe.machines import copy_machine
from floatframe.machines.antenna import pointing

H = 1e-3  #: step of both [s]


def main() -> None:
    """Print a table."""
    logging.disable(logging.WARNING)
    t_end = float(sys.argv[1]) if len(sys.argv) > 1 else 4.5
    with tempfile.TemporaryDirectory() as name:
        copy_machine("antenna", Path(name) / "antenna")
        folder = Path(name) / "antenna" / "fine"
        for part in ("petal", "strut"):
            cms.write(cms.reduce_job(folder / f"{part}.toml"), folder / f"{part}.h5")
        for which in ("latching", "play"):
            system, run = ff.read_system(folder / f"{which}.toml")
            assert run is not None
            model = compiled_system(system).model
            n_u, n_w = int(model.bodies.u0[-1]), int(model.connections.w0[-1])
            begun = time.process_time()
            motion = ff.integrate(system, run.integrator, t_end, H, output_every=10)
            cost = (time.process_time() - begun) / t_end
            (event,) = motion.head.summary["events"]
            after, late = motion.t > event["t"], motion.t > t_end - 1.0
            found = pointing(system, motion)
            struts = [np.linalg.norm(motion.reaction(f"foot_{k}").force, axis=1) for k in range(1, 25)]
            print(f"{which}: {n_u} + {n_w} = {n_u + n_w} unknowns, {cost:.1f} s of processor a second")
            print(f"  latched at {event['t']:.3f} s, impulse {event['impulse']['latch']:.3f} N s")
            print(f"  largest strut force after it {np.array(struts)[:, after].max():.0f} N")
            theta = found.theta - np.deg2rad(75)
            print(f"  petals off their angle {1e3 * np.abs(theta[after]).max():.2f} mrad at most, in the last second")
            last = 1e3 * theta[late]
            print(f"  {last.std():.2f} mrad (standard deviation), {last.mean():+.3f} mrad on the mean")
            if which == "play":
                seen = ff.results.element_motion(system, motion, "hinge_1").outputs
                print(f"  pins free of their bearings {100 * (seen['contacts'][after] == 0).mean():.0f} % of the time")
                print(f"  largest force on a pin {seen['force'].max():.0f} N", flush=True)


if __name__ == "__main__":
    main()
