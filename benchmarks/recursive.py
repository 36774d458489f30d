"""What the recursive equations cost: `python -m benchmarks.recursive` (Pinocchio from the extra `test`).

Processor time of one evaluation in a compiled loop, the shortest of five rounds. Pinocchio is called from Python; what
a call of the same function costs for a model without joints is taken off.
"""

import time
from collections.abc import Callable

import numpy as np
import scipy.linalg as la

import cms
import fe_models
import floatframe as ff
from floatframe.components.mechanisms import chain
from floatframe.engine.tree.recursion.entry import FORWARD, INVERSE, MASS, TANGENTS

TASKS = {"inverse dynamics": INVERSE, "mass matrix": MASS, "forward dynamics": FORWARD, "derivatives": TANGENTS}
ROUNDS = 5


def shortest(run: Callable[[int], object], seconds: float = 0.08) -> float:
    """Return the processor time of one evaluation [µs]; run: does so many."""
    run(1)
    n, took = 1, 0.0
    while took < 0.2 * seconds:
        n *= 4
        began = time.process_time()
        run(n)
        took = time.process_time() - began
    n = max(1, int(n * seconds / took))
    times = []
    for _ in range(ROUNDS):
        began = time.process_time()
        run(n)
        times.append((time.process_time() - began) / n)
    return 1e6 * min(times)


def moving(model: ff.analyses.RelativeModel, seed: int = 0) -> ff.analyses.RelativeModel:
    """Return a model with a motion in its working arrays."""
    rng = np.random.default_rng(seed)
    z = model.moved(model.positions()[0], 0.3 * rng.normal(size=model.n_rates))
    model.take(z, rng.normal(size=model.n_rates), rng.normal(size=model.n_rates))
    return model


def compiled(model: ff.analyses.RelativeModel, what: int) -> float:
    """Return the processor time of one evaluation [µs]."""
    return shortest(lambda n: model.run(what, n))


def times_of_chains(sizes: tuple[int, ...], tasks: dict[str, int] = TASKS) -> dict[str, list[float]]:
    """Return times over the length of a chain of rigid bodies on hinges [µs]."""
    models = [moving(ff.analyses.relative_model(chain(n))) for n in sizes]
    return {name: [compiled(model, what) for model in models] for name, what in tasks.items()}


def exponent(sizes: tuple[int, ...], times: list[float]) -> float:
    """Return the power of the size with which times grow."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def growth() -> None:
    """Print times over the length of a chain, and the exponent over the last decade."""
    sizes = (10, 30, 100, 300, 1000)
    print("chain of rigid bodies on hinges, µs")
    print(f"{'':20s}" + "".join(f"{n:>10d}" for n in sizes) + "  exponent from 100 on")
    for name, times in times_of_chains(sizes).items():
        print(f"{name:20s}" + "".join(f"{t:10.1f}" for t in times) + f"  {exponent(sizes[2:], times[2:]):.2f}")


def pairs_of_times(branching: float) -> dict[str, tuple[float, float]]:
    """Return our time and Pinocchio's of each task for a tree of 30 bodies on hinges [µs]."""
    import pinocchio as pin

    from tests.floatframe.engine.tree.random_trees import PinocchioTree, random_state, random_tree, system_of

    empty = pin.Model()
    nothing, none = empty.createData(), np.zeros(0)
    functions = {
        "inverse dynamics": lambda m, d, x, v, a: pin.rnea(m, d, x, v, a),
        "mass matrix": lambda m, d, x, v, a: pin.crba(m, d, x),
        "forward dynamics": lambda m, d, x, v, a: pin.aba(m, d, x, v, a),
        "derivatives": lambda m, d, x, v, a: pin.computeRNEADerivatives(m, d, x, v, a),
    }
    rng = np.random.default_rng(1)
    links = random_tree(30, rng, kinds=("revolute",), branching=branching, reverse=False)
    model, other = ff.analyses.relative_model(system_of(links)), PinocchioTree(links)
    z, z_dot, z_ddot = random_state(links, rng)
    model.take(z, z_dot, z_ddot)
    theirs = other.model, other.data, other.x(z), other.v(z_dot), other.v(z_ddot)
    pairs = {}
    for name, what in TASKS.items():
        call = functions[name]

        def repeated(n: int, call=call) -> None:
            for _ in range(n):
                call(*theirs)

        bare = shortest(lambda n, call=call: [call(empty, nothing, none, none, none) for _ in range(n)])
        pairs[name] = compiled(model, what), shortest(repeated) - bare
    return pairs


def beside_pinocchio() -> None:
    """Print times beside Pinocchio's for trees of 30 bodies on hinges."""
    import pinocchio as pin

    print(f"\n30 rigid bodies on hinges, µs: ours, Pinocchio {pin.__version__} from PyPI, ratio")
    for words, branching in (("chain", 0.0), ("tree", 0.3), ("bushy tree", 0.7)):
        for name, (ours, beside) in pairs_of_times(branching).items():
            print(f"{words:12s}{name:20s}{ours:10.2f}{beside:10.2f}{ours / beside:8.2f}")


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    told = {f"{name}, chain of 30, over Pinocchio": a / b for name, (a, b) in pairs_of_times(0.0).items()}
    sizes = (100, 1000)
    linear = {name: TASKS[name] for name in ("inverse dynamics", "forward dynamics")}
    for name, times in times_of_chains(sizes, linear).items():
        told[f"{name}, exponent of growth from 100 to 1000 bodies"] = exponent(sizes, times)
    return told


def against_factorisation() -> None:
    """Print forward dynamics by articulated bodies beside mass matrix and its Cholesky factors."""
    print("\nforward dynamics of chains, µs: articulated bodies; mass matrix, inverse dynamics and Cholesky; ratio")
    for n in (3, 6, 10, 30, 100, 300):
        model = moving(ff.analyses.relative_model(chain(n)))
        articulated = compiled(model, FORWARD)
        both = compiled(model, MASS) + compiled(model, INVERSE)
        M, right = model.mass_matrix(model.work.x), np.ones(n)

        def solve(times: int, M=M, right=right) -> None:
            for _ in range(times):
                factors, _ = la.lapack.dpotrf(M)
                la.lapack.dpotrs(factors, right)

        both += shortest(solve)
        print(f"{n:6d}{articulated:12.1f}{both:12.1f}{articulated / both:8.2f}")


def flexible() -> None:
    """Print times of a chain of 30 flexible beams over their modes."""
    print("\nchain of 30 flexible beams with geometric stiffness, µs")
    print(f"{'':16s}" + "".join(f"{name:>18s}" for name in TASKS))
    line = fe_models.beams.BeamLine(1.0, 4.7, 1.26e8, 4.2e3, 9.5e3, 3.8e3, rho_Iy=1.6e-4, rho_Iz=3.5e-4)
    for n_bending in (0, 2, 4, 8):
        rod = None
        if n_bending:
            rod = cms.reduction.beam_from_assumed_modes(
                line, name="beam", units=cms.unit_system("m-kg-s"), n_axial=1, n_bending=n_bending, n_torsion=1,
                n_shear=0, stations={"start": 0.0, "end": 1.0},
            )  # fmt: skip
        model = moving(ff.analyses.relative_model(chain(30, rod=rod)))
        times = [compiled(model, what) for what in TASKS.values()]
        print(f"{rod.n_q if rod else 0:4d} modes a beam" + "".join(f"{took:18.1f}" for took in times))


def main() -> None:
    """Print all tables."""
    growth()
    against_factorisation()
    flexible()
    beside_pinocchio()


if __name__ == "__main__":
    main()
