"""How well a single stiffened body follows spinning beams: errors against a geometrically exact beam and theory.

    python benchmarks/spinning_beams.py

Spin-up of both data sets over 20 s (h = 0.01, 6 fixed-interface modes in the plane): largest error of deflection and
elongation of the tip by their largest values, in the frame at the root and the mean frame, with and without
stiffening. Rotating cantilever: largest relative error of the first three flap and lag frequencies over speed (in units
of sqrt(EI/(rho A L⁴))) and hub radius, for 8 fixed-interface modes in each plane.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import cms
from floatframe.components.mechanisms import rotating_blade
from floatframe.errors import ConvergenceError
from tests.floatframe.engine.compiling import test_spinning_beams as beams
from tests.references.rotating_beam import cantilever_frequencies


def main():
    frames = {"root": cms.NodalFrame("root"), "mean": cms.TisserandFrame()}
    print("spin-up          frame  stiffened  deflection  elongation")
    for name, data in {"Simo & Vu-Quoc": beams.SIMO_VU_QUOC, "Wu & Haug": beams.WU_HAUG}.items():
        exact = beams.exact_spin_up(data, 20.0, 0.01, 6)
        for frame, place in frames.items():
            beam = beams.planar_beam(data, place)
            for stiffening in (True, False):
                try:
                    found = beams.spun_up(data, beam, 20.0, 0.01, stiffening=stiffening)
                    told = "  ".join(f"{error:10.2e}" for error in beams.errors(found, exact))
                except ConvergenceError:
                    told = "  diverges"
                print(f"{name:16s} {frame:>5s} {'yes' if stiffening else 'no':>10s}  {told}", flush=True)
    body = beams.coupled_beam(beams.LENGTH, beams.THIN_SECTION, beams.ALLOY, 24)
    blade = beams.reduced(body, 16, frames["root"])
    print("cantilever  hub/L  speed      flap       lag")
    for alpha in (0.0, 1.0):
        for eta in (1, 3, 6, 12):
            found = beams.frequencies_at(rotating_blade(blade, hub_radius=alpha * beams.LENGTH), (0, 0, eta))
            worst = []
            for delta in (0, 1):
                expected = cantilever_frequencies(eta, alpha, delta=delta)[:3]
                worst.append(np.abs(beams.nearest(found, expected) / expected - 1).max())
            print(f"{alpha:17.1f} {eta:6d}  {worst[0]:8.1e}  {worst[1]:8.1e}", flush=True)


if __name__ == "__main__":
    main()
