"""The checks of the project, in named groups: `python -m tests` runs the group `ci`.

    python -m tests              # lint, types, tests, notebooks, documentation: what every change has to pass
    python -m tests --long       # studies of minutes, motions by plain numba, and --relative
    python -m tests --relative   # tests of the engine again, in the coordinates of joints
    python -m tests --external   # beside other programs; those that are not there are skipped, visibly
    python -m tests --campaign   # seeded bad inputs, kills, random motions and bodies
    python -m tests --changed    # lint, and tests that guard what changed since main (or --changed HEAD~3)
    python -m tests --guards cms/linear_algebra/solvers/eigen.py    # which tests guard a module
    python -m tests --mutants 60 --seed 5    # lines of physics changed at random: do their tests notice

A group is a row of stages. The checks of a stage run side by side, each as its own process, and each report is printed
as a whole when its check ends; the first stage in which one fails ends the run. The checks of one process run beside
the tests, so that no core waits for the end of another check. The last line says how long the group took, and what it
may take on a machine with two cores.

Tests are spread over workers, a processor each (file by file, so that fixtures of a module are made once). A worker
leaves the other processors to the other workers: the libraries in it have one thread, whatever the machine, unless
OMP_NUM_THREADS says otherwise. Results may not depend on either number.
"""

import difflib
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

from tests.floatframe.formulations import SHORT
from tests.root import ROOT

MOST_WORKERS = 4  #: each takes up to 3 GB

n_processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
#: a worker that disappears is not replaced, so that the report names its test
SPREAD = ("-n", str(min(n_processors, MOST_WORKERS)), "--dist", "loadfile", "--max-worker-restart", "0")

LINT = ("lint", "ruff", "check", ".")
SPELLING = (
    "spelling", "codespell_lib", ".github", "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs", "notebooks",
    "benchmarks", "cms", "fe_models", "floatframe",
)  # fmt: skip
TYPES = ("types", "mypy")
#: else each worker compiles them
KERNELS = ("kernels", "floatframe.cli.compile_kernels", "relative", "schemes", "recursion", "cholesky")
#: small kernels compiled by plain numba, as with a numba that the lean compiler does not know
PLAIN = (
    "small kernels by plain numba", "pytest", "-q",
    "tests/floatframe/engine/kernels/test_arrays.py", "tests/floatframe/engine/kernels/test_dense.py",
)  # fmt: skip
#: all kernels of motions: plain numba compiles them in minutes
PLAIN_MOTIONS = (
    "motions by plain numba", "pytest", "-q", "-o", "timeout=3600", "-m", "not long", "tests/floatframe/engine/kernels",
    "--ignore=tests/floatframe/engine/kernels/compiler", "tests/floatframe/integrators/test_pendulum.py",
)  # fmt: skip
TESTS = (
    "tests", "pytest", "-q", *SPREAD, "--no-loadscope-reorder", "-p", "tests.slowest",
    "-m", "not long and not external", "tests",
)  # fmt: skip
LONG = ("long tests", "pytest", "-q", "--durations=0", "-m", "long and not external", "tests")
RELATIVE = (
    "engine in joint coordinates", "pytest", "-q", *SPREAD, "--formulation", "relative",
    "-m", "not long and not external", "tests/floatframe",
)  # fmt: skip
RELATIVE_IN_SHORT = ("some in joint coordinates", "pytest", "-q", "--formulation", "relative", *SHORT)
EXTERNAL = ("tests beside other programs", "pytest", "-q", "-rs", "-m", "external", "tests")
DOCUMENTATION = ("documentation", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "docs", "build/site")

Check = tuple[str, ...]  #: its name, then the module of Python that makes it with its arguments


@dataclass(frozen=True)
class Group:
    """Checks that are run together."""

    stages: tuple[tuple[Check, ...], ...]  #: one after another; the checks of one side by side
    minutes: float  #: it may take, on two cores


GROUPS = {
    "ci": Group(((LINT, SPELLING), (TYPES, KERNELS), (TESTS, PLAIN, DOCUMENTATION, RELATIVE_IN_SHORT)), 20),
    "long": Group(((LONG,), (PLAIN_MOTIONS,), (RELATIVE,)), 90),
    "relative": Group(((KERNELS,), (RELATIVE,)), 15),
    "external": Group(((EXTERNAL,),), 10),
}


def main(arguments: list[str]) -> int:
    """Run a group of checks from the root of the checkout; return the exit code of the first that fails."""
    if arguments[:1] == ["--campaign"]:
        from tests.campaign import main as campaign

        return campaign(arguments[1:])
    if arguments[:1] == ["--mutants"]:
        from tests.mutants import main as mutants

        return mutants(arguments[1:])
    if arguments[:1] == ["--guards"]:
        return tell_guards(arguments[1:])
    if arguments[:1] == ["--changed"]:
        return run_changed(arguments[1:])
    names = [argument.removeprefix("--") for argument in arguments] or ["ci"]
    if len(names) > 1 or names[0] not in GROUPS:
        choices = ", ".join(f"--{name}" for name in (*GROUPS, "campaign", "changed", "guards", "mutants"))
        print(f"python -m tests: expected one of {choices}, or nothing for --ci; got {' '.join(arguments)}")
        return 2
    return run_told(names[0], GROUPS[names[0]])


def run_told(name: str, group: Group) -> int:
    """Run a group, and say what became of it and how long it took; return the exit code."""
    begun = time.monotonic()
    code = run(group)
    minutes = (time.monotonic() - begun) / 60
    verdict = "all checks passed" if code == 0 else f"failed with exit code {code}"
    over = f", OVER its budget of {group.minutes:g}" if minutes > group.minutes else f" of {group.minutes:g}"
    print(f"\n== group {name}: {verdict}; {minutes:.1f} minutes{over}", flush=True)
    return code


def run(group: Group) -> int:
    """Run the stages of a group up to the first in which a check fails, and return the exit code of that check."""
    for stage in group.stages:
        codes = [run_alone(stage[0])] if len(stage) == 1 else run_side_by_side(stage)
        if code := next((code for code in codes if code), 0):
            return code
    return 0


def tell_guards(words: list[str]) -> int:
    """Print the test files that guard some modules, by how many imports lie between, nearest first."""
    if not words:
        print("python -m tests --guards: expected files or modules, such as fe_models/body/weld.py")
        return 2
    from tests.import_graph import guards, modules, named_modules

    for word in words:
        names = named_modules([word])
        if not names or not (word in names or (ROOT / word).exists()):
            near = difflib.get_close_matches(word.replace("/", ".").removesuffix(".py"), modules(), 3)
            print(f"python -m tests --guards: {word}: no such module{'; near: ' + ', '.join(near) if near else ''}")
            return 2
        found = guards(names)
        print(f"{word}: {len(found)} test files, by the imports between")
        print("".join(f"{n:4d}  {file}\n" for file, n in found.items()), end="", flush=True)
    return 0


def run_changed(words: list[str]) -> int:
    """Run the linter, and the tests that guard what changed since main or another base."""
    from tests.import_graph import changed_files, guards, named_modules

    try:
        files = changed_files(*words)
    except ValueError as error:
        print(f"python -m tests --changed: {error}")
        return 2
    found = list(guards(named_modules(files)))
    print(f"{len(files)} files changed since {words[0] if words else 'main'}, {len(found)} test files guard them")
    tests = ("tests", "pytest", "-q", *SPREAD, "-m", "not long and not external", *found)
    return run_told("changed", Group(((LINT,), (tests,)) if found else ((LINT,),), GROUPS["ci"].minutes))


def environment(check: Check) -> dict[str, str]:
    """Return the environment of a check: libraries have one thread, but in checks that run alone.

    Modules are always stored as byte code: tests start hundreds of processes, and each would compile what it imports.
    """
    threads = {} if check in (LONG, EXTERNAL) else {"OMP_NUM_THREADS": "1"}
    compiler = {"FLOATFRAME_COMPILER": "plain"} if check in (PLAIN, PLAIN_MOTIONS) else {}
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**threads, **inherited, **compiler, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}


def run_alone(check: Check) -> int:
    """Run one check, whose report appears as it is written; return its exit code."""
    name, *command = check
    print(f"\n== {name}: {' '.join(command)}", flush=True)
    begun = time.monotonic()
    done = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, env=environment(check), check=False)
    conclude(name, done.returncode, begun)
    return done.returncode


def run_side_by_side(checks: tuple[Check, ...]) -> list[int]:
    """Run checks at the same time, print the report of each when it ends; return their exit codes in order of ends."""
    begun, running, codes = time.monotonic(), {}, []
    for check in checks:
        name, *command = check
        report = tempfile.TemporaryFile()
        started = [sys.executable, "-m", *command]
        process = subprocess.Popen(started, cwd=ROOT, env=environment(check), stdout=report, stderr=subprocess.STDOUT)
        running[name] = process, report, command
    while running:
        name = next((name for name, (process, *_) in running.items() if process.poll() is not None), None)
        if name is None:
            time.sleep(0.1)
            continue
        process, report, command = running.pop(name)
        print(f"\n== {name}, beside others: {' '.join(command)}", flush=True)
        report.seek(0)
        print(report.read().decode(errors="replace"), end="")
        report.close()
        conclude(name, process.returncode, begun)
        codes.append(process.returncode)
    return codes


def conclude(name: str, code: int, begun: float) -> None:
    """Print how long a check took, and that it failed if it did."""
    print(f"== {name}: {(time.monotonic() - begun) / 60:.1f} minutes", flush=True)
    if code:
        print(f"== {name} failed with exit code {code}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
