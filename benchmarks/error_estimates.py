"""Estimated errors of frequencies and frequency responses against true ones, for all mode sets; and their cost.

python -m benchmarks.error_estimates                  # 60 seeds, bars and panels, all mode sets: some minutes
python -m benchmarks.error_estimates --cost 12        # a bar of 48 x 12 x 12 bricks of tet10, 50 modes
"""

import argparse
import logging
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import scipy.linalg as la

import fe_models as fm
from cms.body.reduced_body import BodyFrame
from cms.errors import CmsError
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.error_estimates import (
    enlarged_space,
    error_estimates,
    guards_of,
    response_errors,
    response_loads,
    static_loads,
)
from cms.reduction.mesh_error import mesh_errors
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import MULTIPLIER, FEBody, Interface
from fe_models.errors import FeModelsError
from tests.bodies import STEEL, bar
from tests.campaign.random_bodies import random_body

LEAST_RESPONSE = 1e-6  #: true error of a response, below which it is rounding
NO_MASS = 1e-9  #: mu of a shape divided by that of the first, below which it has no mass
LEAST, MOST = 1e-8, 0.5  #: true errors of frequency that are counted: below is rounding, above is no approximation
MEAN_AXES = BodyFrame("tisserand", np.zeros(3))
SETS = [name for name in MODE_SETS if name != "user-basis"]


def bodies(n: int) -> Iterator[tuple[int, FEBody]]:
    """Yield coupled bodies with a seed: random ones of every element, bars and panels with up to 200 modes."""
    for seed in range(n):
        try:
            body = fm.couple(random_body(seed).body)
        except FeModelsError:  # bodies that no interface fits
            continue
        if not (body.dofs[:, 1] == MULTIPLIER).any():  # LAPACK needs a definite matrix
            yield seed, body
    large = [
        *(bar(nx=16, ny=3, nz=3, kind=kind) for kind in ("tetra10", "hexahedron20", "hexahedron", "wedge15")),
        *(panel(kind, rise) for kind in ("quad", "triangle") for rise in (0.0, 0.6)),
    ]
    for seed, body in enumerate(large):
        yield n + seed, fm.couple(body)


def panel(kind: str, rise: float) -> FEBody:
    """Return a square plate or a cylindrical panel of shells with rigid interfaces on two edges."""
    mesh = fm.shells.mapped_shell(lambda u, v: np.stack([u, v, rise * u * (1 - u)], axis=1), 14, 14, kind=kind)
    ports = [
        Interface(name, "rigid", edge := np.flatnonzero(mesh.nodes[:, 1] == y), mesh.nodes[edge].mean(axis=0))
        for name, y in (("left", 0.0), ("right", 1.0))
    ]
    steel, units = fm.shells.ShellProperty(0.02, STEEL), fm.unit_system("m-kg-s")
    return fm.shell_body(mesh, steel, name="panel", units=units, interfaces=ports)


def set_of(name: str, families: Families, rng: np.random.Generator) -> Any:
    """Return a mode set with a random number of modes; None if the body has no such set."""
    most = min(200, families.body.n_dof // 4)
    options: dict[str, Any] = {"n_modes": int(rng.integers(3, max(4, most)))}
    options = {"guyan": {}, "krylov": {"n_blocks": 2}}.get(name, options)
    try:
        return MODE_SETS[name](families, **options)
    except (CmsError, TypeError):
        return None


def exact_modes(families: Families) -> tuple[np.ndarray, np.ndarray]:
    """Return 1 / omega² and the elastic free modes of unit strain energy by LAPACK: M x = mu (K + s M) x."""
    body, n_rigid = families.body, families.free.N.shape[1]
    K, M = body.K.toarray(), body.M.toarray()
    s = float(families.free_modes(n_modes=1).omega2[0])
    size = 1 / np.sqrt(np.diag(K + s * M))
    mu, X = la.eigh(M * np.outer(size, size), (K + s * M) * np.outer(size, size))
    mu, X = np.maximum(mu[::-1][n_rigid:], 0.0), size[:, None] * X[:, ::-1][:, n_rigid:]
    return mu / (1 - s * mu), X / np.sqrt(1 - s * mu)


def judged(n: int) -> tuple[int, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the number of bodies, and errors of frequencies and of responses of each set.

    Columns are the true and the estimated error; for frequencies also the largest one, and whether it is uncertain.
    """
    found: dict[str, list[tuple[float, ...]]] = {name: [] for name in SETS}
    responses: dict[str, list[tuple[float, ...]]] = {name: [] for name in SETS}
    n_bodies = 0
    for seed, body in bodies(n):
        rng = np.random.default_rng(seed)
        with Families(body, announce=False) as families:
            mu, X = exact_modes(families)
            exact = 1 / (2 * np.pi * np.sqrt(mu[mu > NO_MASS * mu[0]]))
            loads = response_loads(body)
            n_bodies += 1
            for name in SETS:
                if (modes := set_of(name, families, rng)) is None:
                    continue
                try:
                    basis = free_basis(body, modes, families)
                    errors = error_estimates(families, modes, basis, basis.Phi, MEAN_AXES)
                except CmsError:
                    continue
                k = min(len(errors.frequency), len(exact))
                largest = errors.largest if len(errors.largest) else np.full(len(errors.frequency), np.nan)
                of_modes = (errors.frequency, largest, errors.is_uncertain)
                found[name] += zip(
                    basis.frequencies()[:k] / exact[:k] - 1, *(each[:k] for each in of_modes), strict=True
                )
                true = response_errors(basis, len(errors.frequency), loads, loads.T @ X, mu)
                responses[name] += zip(true, errors.response, strict=True)
    return n_bodies, *(
        {name: np.array(rows).reshape(-1, n_columns) for name, rows in each.items()}
        for each, n_columns in ((found, 4), (responses, 2))
    )


def print_judged(n: int) -> None:
    """Print for each set how many estimates are within a factor of two of the true error."""
    n_bodies, frequencies, responses = judged(n)
    print(f"{n_bodies} bodies; true errors from {LEAST:g} to {MOST:g}")
    print_ratios("errors of frequencies", frequencies, LEAST)
    print_limits(np.concatenate(list(frequencies.values())))
    print_ratios("errors of frequency responses between the interfaces", responses, LEAST_RESPONSE)


def print_ratios(title: str, found: dict[str, np.ndarray], rounding: float) -> None:
    """Print how many estimates of each set are within a factor of two of true errors above rounding."""
    print(f"\n{title}")
    print(f"{'set':26s}{'modes':>7s}{'counted':>9s}{'in [0.5, 2]':>13s}{'least':>8s}{'most':>7s}{'exact':>7s}")
    for name, pairs in [*found.items(), ("all", np.concatenate(list(found.values())))]:
        true, estimate = pairs[:, :2].T
        is_counted = (true > rounding) & (true < MOST)
        ratio = estimate[is_counted] / true[is_counted]
        within = f"{100 * np.mean((ratio >= 0.5) & (ratio <= 2)):.1f} %" if len(ratio) else ""
        span = (f"{ratio.min():.2f}", f"{ratio.max():.2f}") if len(ratio) else ("", "")
        n_exact = int((true <= rounding).sum())
        print(f"{name:26s}{len(true):7d}{len(ratio):9d}{within:>13s}{span[0]:>8s}{span[1]:>7s}{n_exact:7d}")


def print_limits(found: np.ndarray) -> None:
    """Print how many estimates are marked uncertain, the least of the others, and whether any limit is exceeded."""
    true, estimate, largest = found[:, :3].T
    is_uncertain, is_counted = found[:, 3] > 0, (true > LEAST) & (true < MOST)
    certain = is_counted & ~is_uncertain
    far = is_counted & (estimate < 0.2 * true)
    print(
        f"uncertain: {(is_counted & is_uncertain).sum()} of {is_counted.sum()}; of exact ones "
        f"{(is_uncertain & (true <= LEAST)).sum()} of {(true <= LEAST).sum()}"
    )
    print(f"below 0.2 of the true error: {far.sum()}, of which uncertain {(far & is_uncertain).sum()}")
    print(
        f"least ratio of those not uncertain: {(estimate / true)[certain].min():.2f}; within [0.5, 2]: "
        f"{100 * np.mean((estimate / true)[certain] >= 0.5):.1f} %"
    )
    print(
        f"true errors above the largest one: {(is_counted & (true > largest * 1.001 + LEAST)).sum()} of "
        f"{(is_counted & np.isfinite(largest)).sum()}"
    )


def print_cost(n: int, n_modes: int) -> None:
    """Print the time of the estimates beside that of the reduction, in processor time and by the clock."""
    body = fm.couple(bar(nx=4 * n, ny=n, nz=n, width=0.25, height=0.25, kind="tetra10"))
    seconds = {}

    def timed(name: str, work: Callable[[], Any]) -> Any:
        began = time.perf_counter(), time.process_time()
        found = work()
        seconds[name] = time.perf_counter() - began[0], time.process_time() - began[1]
        return found

    with Families(body) as families:
        reduced = timed(
            "set and reduction",
            lambda: reduce(families, MODE_SETS["craig-bampton"](families, n_modes=n_modes), errors=False),
        )
        modes = MODE_SETS["craig-bampton"](families, n_modes=n_modes)
        basis = free_basis(body, modes, families)
        mesh_errors(body, basis, 1)  # compiles
        errors = timed("estimates", lambda: error_estimates(families, modes, basis, basis.Phi, MEAN_AXES))
        n_judged, loads = len(errors.frequency), static_loads(families, None)
        guards = guards_of(modes)
        timed("reduction errors", lambda: enlarged_space(families, basis, n_judged, loads, guards, has_statics=True))
        timed("mesh errors", lambda: mesh_errors(body, basis, n_judged))
    print(f"{body.n_dof} dofs, {reduced.n_q} modes, {len(errors.frequency)} of them judged")
    for name, (clock, processor) in seconds.items():
        print(f"{name:20s}{clock:8.1f} s by the clock, {processor:8.1f} s of the processors")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=60, help="number of seeds of random bodies")
    parser.add_argument("--cost", type=int, help="elements across the bar whose estimates are timed")
    parser.add_argument("--modes", type=int, default=50, help="number of modes of the timed set")
    asked = parser.parse_args()
    logging.disable(logging.WARNING)
    warnings.simplefilter("ignore")
    if asked.cost:
        print_cost(asked.cost, asked.modes)
    else:
        print_judged(asked.bodies)
