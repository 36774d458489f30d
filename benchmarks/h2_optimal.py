"""H2 errors of the set h2-optimal, of other sets and of pyMOR's second-order reductors, with as many columns.

    python -m benchmarks.h2_optimal               # half a minute; pip install ".[bench]"

A distorted steel bar with rigid interfaces, every elastic mode damped by the same ratio, loads and responses at chosen
dofs. All read the same matrices in modal coordinates, in the unit of time of the lowest mode, as pyMOR's solvers need.
Errors are |H - H_V| / |H| of the whole model; seconds are those of the processor. pyMOR counts iterations of SOR-IRKA,
each with an IRKA of its own; it stops at 30.
"""

import time

import numpy as np
import scipy.linalg as la

import cms
import fe_models as fm
from cms.modes.families.families import Families
from cms.modes.mode_sets import balanced_truncation, h2_optimal, krylov, normal_modes
from cms.modes.mode_sets.h2_optimal import H2Problem
from tests.bodies import STEEL, box_mesh, distorted

CASES = [(ratio, places) for ratio in (0.01, 0.05) for places in (["left uz"], ["left ux", "left uz", "right uy"])]
N_MODES = 8
TOLERANCE, MOST = 1e-4, 30  #: of the shifts of SOR-IRKA, and its iterations


def crooked_bar():
    """Return a coupled bar without symmetry."""
    mesh = distorted(box_mesh(7, 1, 1, 0.6, 0.08, 0.05), 0.1, seed=2)
    ends = [cms.Interface(name, "rigid", mesh.node_sets[name], mesh.nodes[mesh.node_sets[name]].mean(axis=0))
            for name in ("left", "right")]  # fmt: skip
    return cms.couple(fm.solid_body(mesh, STEEL, name="bar", units=cms.unit_system("m-kg-s"), interfaces=ends))


def compare(ratio, places):
    """Print the error and time of each way for loads and responses at these places."""
    from pymor.models.iosys import SecondOrderModel
    from pymor.reductors.sobt import SOBTpReductor
    from pymor.reductors.sor_irka import SORIRKAReductor

    body = crooked_bar()
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    omega2, Phi = omega2[6:], Phi[:, 6:]
    rows = sorted(body.interface(place.split()[0]).dofs["xyz".index(place[-1])] for place in places)
    at = Phi[rows]
    unit = np.sqrt(omega2[0])
    B = (at / np.sqrt(np.einsum("bk,bk->b", at, at / omega2))[:, None]).T / unit
    K, D = omega2 / unit**2, np.diag(2 * ratio * np.sqrt(omega2)) / unit
    problem = H2Problem(K, D, B)
    print(f"\n{len(K)} elastic modes, damping {ratio}, loads and responses {', '.join(places)}, {N_MODES} columns")

    def row(name, error, seconds, words=""):
        print(f"  {name:34s}{error:10.2e}{seconds:9.2f} s  {words}", flush=True)

    chosen = {"inputs": places, "damping_ratio": ratio, "n_rich": body.n_dof}
    with Families(body) as families:
        families.free_modes(len(K))
        for name, make in {
            "h2-optimal, static = false": lambda: h2_optimal(families, n_modes=N_MODES, static=False, **chosen),
            "balanced-truncation": lambda: balanced_truncation(families, n_modes=N_MODES, **chosen),
            "normal": lambda: normal_modes(families, n_modes=N_MODES),
            "krylov (first columns)": lambda: krylov(families, n_modes=N_MODES),
        }.items():
            start = time.process_time()
            modes = make()
            seconds = time.process_time() - start
            V = Phi.T @ (body.M @ modes.columns[:, 6 : 6 + N_MODES])
            error = np.sqrt(max(problem.error(V / la.norm(V, axis=0)), 0.0))
            row(name, error, seconds, modes.options.get("iterations", ""))
    whole = SecondOrderModel.from_matrices(np.eye(len(K)), D, np.diag(K), B, B.T)
    irka = SORIRKAReductor(whole)
    for name, reductor, options in (
        ("pyMOR SOR-IRKA", irka, {"tol": TOLERANCE, "maxit": MOST}),
        ("pyMOR SOBTp", SOBTpReductor(whole), {}),
    ):
        start = time.process_time()
        reduced = reductor.reduce(N_MODES, **options)
        seconds = time.process_time() - start
        words = f"{len(irka.conv_crit)} iterations, last change {irka.conv_crit[-1]:.0e}" if reductor is irka else ""
        row(name, (whole - reduced).h2_norm() / whole.h2_norm(), seconds, words)


if __name__ == "__main__":
    from pymor.core.logger import set_log_levels

    set_log_levels({"pymor": "ERROR"})
    for case in CASES:
        compare(*case)
