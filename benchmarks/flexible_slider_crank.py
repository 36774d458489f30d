"""A slender rod in a fast crank drive in every description, against a geometrically exact beam.

    python -m benchmarks.flexible_slider_crank            # both starts; about ten minutes, most of it the exact beam

Largest error of the deflection of the middle and of the shortening of the chord over two turns, parts of their largest
values. At once: the rod rings along its axis, so that the shortening is averaged over 1 ms.
"""

import argparse
from time import perf_counter

from floatframe.errors import FloatframeError
from tests.references.slender_rod import DESCRIPTIONS, drive_at_once, exact, moved, soft_start


def table(title: str, drive, t_end: float, n_steps: int, window: float) -> None:
    """Print a table."""
    begin = perf_counter()
    reference = exact(drive, t_end, 2 * n_steps, n=8, every=2)
    largest = 1e3 * abs(reference.deflection).max(), -1e3 * reference.lengthening.min()
    print(f"{title}: largest deflection {largest[0]:.3f} mm, shortening {largest[1]:.3f} mm; ", end="")
    print(f"exact beam {perf_counter() - begin:.0f} s\n")
    print("| rod | unknowns | deflection | shortening | time |\n|---|---|---|---|---|")
    for name, make in DESCRIPTIONS.items():
        rod = make()
        begin = perf_counter()
        try:
            found = moved(rod, drive, t_end, n_steps)
        except FloatframeError as error:
            print(f"| {name} | | {str(error)[:60]} | | |", flush=True)
            continue
        elapsed = perf_counter() - begin
        deflection, shortening = found.errors(reference, window=window)
        n = (
            6 + rod.n_q
            if hasattr(rod, "n_q")
            else 6 * len(rod("rod", position=(0, 0, 0), orientation=(1, 0, 0, 0)).bodies)
        )
        print(f"| {name} | {n} | {100 * deflection:.2f} % | {100 * shortening:.2f} % | {elapsed:.2f} s |", flush=True)
    print()


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--start", choices=("at-once", "soft", "both"), default="both")
    start = parser.parse_args().start
    if start in ("at-once", "both"):
        drive, t_end = drive_at_once()
        table("150 rad/s at once", drive, t_end, 2000, 1e-3)
    if start in ("soft", "both"):
        drive, t_end = soft_start()
        table("soft start in 0.1 s", drive, t_end, 2000, 0.0)


if __name__ == "__main__":
    main()
