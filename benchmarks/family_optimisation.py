"""A connecting rod of least mass, with full reductions and with a family: `python -m benchmarks.family_optimisation`.

The rod of `fe_models.parts` (tet10) has two parameters: factors on its width and on its thickness. Its mass becomes as
small as its limits permit: the first two free frequencies, and the deflection of the small end under forces in y and z,
with the big end fixed. With full reductions, every evaluation reduces the job. With the family, `reduce_family` reduces
the grid of samples (and the middle, if there are two values), every evaluation interpolates, and a full reduction at
the end judges the optimum.

Two methods of SciPy: SLSQP with differences, from the full size, and differential evolution, for several optima. The
cost of differential evolution with full reductions is calculated, as many evaluations as with the family at the mean
cost of those of SLSQP; `--all` runs it. Costs are processor times of one thread. The cost of the family includes
samples, their alignment, interpolations and the last reduction. The job has no error estimates, because no evaluation
reads them.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
from scipy.optimize import differential_evolution, minimize

import cms
from cms.body.reduced_body import ReducedBody
from cms.jobs.job import read_job
from cms.reduction import reduce_family
from fe_models.foundation.arrays import Array
from fe_models.parts import mesh_connecting_rod

JOB = """
[parameters]
width = 1.0
thickness = 1.0

[body]
name = "rod"
mesh = "rod.msh"
units = "mm-t-s"
scale = [1.0, "{width}", "{thickness}"]

[materials.steel]
young = 210000.0
poisson = 0.3
density = 7.85e-9
cells = "rod"

[interfaces.big_end]
kind = "rigid"
faces = "big_end"

[interfaces.small_end]
kind = "rigid"
faces = "small_end"

[reduction]
set = "craig-bampton-ir"
n_modes = 12
frame = "nodal"
at = "big_end"
error_estimates = false
"""
RANGE = (0.75, 1.15)  #: of both factors
STEP = 1e-3  #: of the differences, relative to the range
TOLERANCE = 1e-5  #: of the optimiser, relative to the mass at full size


class Counted:
    """Evaluations of a body, each computed once, and their processor time."""

    def __init__(self, body_at: Callable[[Array], ReducedBody]) -> None:
        self.body_at, self.seconds, self.known = body_at, 0.0, dict[bytes, Array]()

    def __call__(self, x: Array) -> Array:
        """Return mass, first two free frequencies, and deflection."""
        key = np.asarray(x, dtype=float).round(12).tobytes()
        if key not in self.known:
            began = process_time()
            self.known[key] = numbers_of(self.body_at(x))
            self.seconds += process_time() - began
        return self.known[key]


def numbers_of(body: ReducedBody) -> Array:
    """Return mass, first two free frequencies and flexibility of the small end across the rod in y and z."""
    Psi = body.interface("small_end").Psi[1:3]
    flexibility = np.einsum("ak,k,ak->a", Psi, 1 / np.diag(body.K), Psi)
    return np.array([body.moments.m, *body.free_frequencies[:2], *flexibility])


def optimum(evaluate: Counted, full: Array, method: str) -> Array:
    """Return the factors of least mass within the limits, which are relative to the body of full size."""
    limits = np.array([0.86 * full[1], 0.86 * full[2], 1.5 * full[3], 1.5 * full[4]])

    def margins(x: Array) -> Array:
        _, f_1, f_2, u_y, u_z = evaluate(x)
        return np.array([f_1 / limits[0] - 1, f_2 / limits[1] - 1, 1 - u_y / limits[2], 1 - u_z / limits[3]])

    if method == "slsqp":
        step = STEP * (RANGE[1] - RANGE[0])
        return minimize(
            lambda x: evaluate(x)[0] / full[0], np.ones(2), method="SLSQP", bounds=[RANGE] * 2,
            constraints={"type": "ineq", "fun": margins}, options={"ftol": TOLERANCE, "eps": step},
        ).x  # fmt: skip
    return differential_evolution(
        lambda x: evaluate(x)[0] / full[0] + 10 * np.maximum(-margins(x), 0).sum(), [RANGE] * 2,
        rng=1, tol=1e-3, polish=False, init="sobol", popsize=8,
    ).x  # fmt: skip


def at_in_range(body_at: Callable[..., ReducedBody]) -> Callable[[Array], ReducedBody]:
    """Return a function of the two factors, which are moved into the range that the optimiser leaves by rounding."""
    return lambda x: body_at(**dict(zip(("width", "thickness"), np.clip(x, *RANGE).tolist(), strict=True)))


def main(size: float, n_values: int, *, runs_all: bool) -> None:
    """Print costs and optima of both methods."""
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "rod.toml"
        job.write_text(JOB)
        mesh_connecting_rod(size=size, path=job.with_name("rod.msh"))

        def reduced(**factors: float) -> ReducedBody:
            return cms.reduce_job(read_job(job, factors))

        full = numbers_of(reduced())  # also loads the libraries
        began = process_time()
        values = tuple(np.linspace(*RANGE, n_values).tolist())
        family = reduce_family(job, {"width": values, "thickness": values})
        family.at(width=1.0, thickness=1.0)  # aligns the samples
        of_family = process_time() - began
        sample, errors = family.samples[0], family.errors
        print(f"{sample.provenance['full dofs']} dofs, {len(family.samples)} samples of {sample.n_q} modes")
        print(*(f"  {name}: {error}" for name, error in ([] if errors is None else errors.rows())), sep="\n")
        of_reduction = 0.0
        for method in ("slsqp", "differential evolution"):
            fast = Counted(at_in_range(family.at))
            x = optimum(fast, full, method)
            last = Counted(at_in_range(reduced))
            error = np.abs(fast(x) / last(x) - 1)
            n, cost = len(fast.known), of_family + fast.seconds + last.seconds
            print(
                f"\n{method}: width {x[0]:.4f}, thickness {x[1]:.4f}, mass {last(x)[0] / full[0]:.4f} of the full size"
            )
            print("  errors of mass, frequencies, deflections at the optimum:", *(f"{100 * e:.2g} %" for e in error))
            print(f"  family {cost:.1f} s: samples {of_family:.1f}, {n} evaluations {fast.seconds:.2f}, last reduction "
                  f"{last.seconds:.2f}")  # fmt: skip
            if method == "slsqp" or runs_all:
                slow = Counted(at_in_range(reduced))
                y = optimum(slow, full, method)
                of_reduction, n, words = slow.seconds / len(slow.known), len(slow.known), f"optimum {y.round(4)}"
            else:
                words = "calculated"
            print(f"  full reductions {n * of_reduction:.1f} s: {n} of {of_reduction:.2f} s, {words}")
            print(f"  ratio {cost / (n * of_reduction):.3f}")
        each = fast.seconds / len(fast.known)
        enough = (of_family + last.seconds) / (0.1 * of_reduction - each)
        print(
            f"\nan evaluation takes {each / of_reduction:.3f} of a reduction; a tenth from {enough:.0f} evaluations on"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--size", type=float, default=5.5, help="element size [mm]")
    parser.add_argument("--values", type=int, default=2, help="values of each parameter")
    parser.add_argument("--all", action="store_true", help="run differential evolution with full reductions")
    given = parser.parse_args()
    main(given.size, given.values, runs_all=given.all)
