"""The start: what `cms demo` and each of its commands take on a new machine (cold) and later (warm), and compilations.

    python -m benchmarks.start              # some six minutes on two quiet cores
    python -m benchmarks.start OLD          # beside another checkout, in turn
    python -m benchmarks.start OLD --runs 3 # the least of three runs of everything

Cold: no kernel is compiled (`NUMBA_CACHE_DIR` is an empty folder); modules have their bytecode. Processor time of the
process and all that it starts, user and system; and by the clock. A compilation is that of
`python -m floatframe.cli.compile_kernels PART`, with its imports and the work that needs the kernels. "From the wheel":
the same with the wheel that `.ci/wheel` builds from the checkout, for the best family that this processor belongs to.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COMPILED = ("motion", "reduction", "cholesky")
COMMANDS = (
    "cms reduce rod.toml -o rod.h5",
    "cms view rod.h5 --mode 3 -o m3.png --animate m3.gif",
    "cms info rod.h5",
    "floatframe run crank.toml -o crank.h5",
    "floatframe plot crank.h5 -o crank.png",
    "floatframe animate crank.h5 --fps 15 -o crank.mp4",
)


@dataclass(frozen=True)
class Cost:
    """What a command takes [s]."""

    processor: float
    clock: float

    def __str__(self) -> str:
        """Return both times."""
        return f"{self.processor:6.1f} {self.clock:6.1f}"


def cost_of(words: str, tree: Path, cache: Path, folder: Path) -> Cost:
    """Return what a command of a checkout takes, its children included."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(cache), "MPLBACKEND": "Agg"}
    module, *arguments = words.split()
    began, before = time.perf_counter(), os.times()
    subprocess.run(
        [sys.executable, "-P", "-m", module, *arguments],
        cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    after = os.times()
    used = after.children_user - before.children_user + after.children_system - before.children_system
    return Cost(used, time.perf_counter() - began)


def unpacked_wheel(tree: Path, folder: Path) -> Path:
    """Return a folder with the packages of a checkout as its wheel brings them, with compiled code."""
    from llvmlite.binding import get_host_cpu_features

    from fe_models.foundation.kernels.jit import FAMILIES

    known = {name for name, is_known in get_host_cpu_features().items() if is_known}
    family = next(name for name, needed in FAMILIES.items() if needed <= known)
    build = [tree / ".ci" / "wheel", folder / "dist", family]
    subprocess.run(build, env=os.environ | {"PYTHON": sys.executable}, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = (folder / "dist").iterdir()
    install = ["pip", "install", "-q", "--no-deps", "--target", folder / "packages", wheel]
    subprocess.run([sys.executable, "-m", *install], check=True)
    return folder / "packages"


def costs(tree: Path, *, stages: bool) -> dict[str, Cost]:
    """Return what the start takes in a checkout; with `stages`, also each command of the demo."""
    found = {}
    with tempfile.TemporaryDirectory(prefix="start-") as name:
        folder = Path(name)
        cost_of("cms.cli --help", tree, folder / "help", folder)  # the bytecode of modules
        for part in COMPILED if stages else COMPILED[:1]:
            compile_part = f"floatframe.cli.compile_kernels {part}"
            found[f"first compilation: {part}"] = cost_of(compile_part, tree, folder / part, folder)
        if (tree / ".ci" / "wheel").is_file():
            packages = unpacked_wheel(tree, folder)
            cost_of("cms.cli --help", packages, folder / "help", folder)
            compile_motion = "floatframe.cli.compile_kernels motion"
            found["first motion from the wheel"] = cost_of(compile_motion, packages, folder / "no cache", folder)
            found["cms demo from the wheel, cold"] = cost_of("cms.cli demo", packages, folder / "none", folder)
            shutil.rmtree(folder / "demo")
        for state in ("cold", "warm"):
            found[f"cms demo, {state}"] = cost_of("cms.cli demo", tree, folder / "cache", folder)
        for words in COMMANDS if stages else ():
            program, rest = words.split(" ", 1)
            found[f"warm: {words}"] = cost_of(f"{program}.cli {rest}", tree, folder / "cache", folder / "demo")
    return found


def least(runs: list[dict[str, Cost]]) -> dict[str, Cost]:
    """Return the least times of several runs."""
    return {
        name: Cost(min(each[name].processor for each in runs), min(each[name].clock for each in runs))
        for name in runs[0]
    }


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps: processor times."""
    found = costs(ROOT, stages=not short)
    return {f"{name} [s of processor]": cost.processor for name, cost in found.items()}


def main() -> None:
    """Print a table with two columns for each checkout."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", nargs="*", type=Path, help="other checkouts")
    parser.add_argument("--runs", type=int, default=1)
    asked = parser.parse_args()
    trees = [*(tree.resolve() for tree in asked.trees), ROOT]
    runs: list[list[dict[str, Cost]]] = [[] for _ in trees]
    for _ in range(asked.runs):
        for tree, kept in zip(trees, runs, strict=True):
            kept.append(costs(tree, stages=True))
    table = [least(kept) for kept in runs]
    print("seconds of processor and by the clock:", ", ".join(str(tree) for tree in trees))
    for name in table[0]:
        print("  ".join(str(each[name]) for each in table), " ", name)
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
