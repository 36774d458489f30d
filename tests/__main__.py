"""The checks of the project, in named groups: `python -m tests` runs the group `ci`.

    python -m tests              # lint, types, tests, notebooks, documentation: what every change has to pass
    python -m tests --long       # studies of minutes
    python -m tests --external   # beside other programs; those that are not there are skipped, visibly
    python -m tests --campaign   # seeded bad inputs and kills

Each check prints its own report, the first failure ends the run. The last line says how long the group took, and what
it may take on a machine with two cores.
"""

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

LINT = ("lint", "ruff", "check", ".")
TYPES = ("types", "mypy")
TESTS = ("tests", "pytest", "-q", "-m", "not long and not external", "tests")
LONG = ("long tests", "pytest", "-q", "--durations=0", "-m", "long and not external", "tests")
EXTERNAL = ("tests beside other programs", "pytest", "-q", "-rs", "-m", "external", "tests")
NOTEBOOKS = ("notebooks", "pytest", "-q", "--nbmake", "--nbmake-timeout=300", "-o", "filterwarnings=", "notebooks")
DOCUMENTATION = ("documentation", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "docs", "build/site")


@dataclass(frozen=True)
class Group:
    """Checks that are run together."""

    checks: tuple[tuple[str, ...], ...]  #: name of a check, then the module of Python that makes it with its arguments
    minutes: float  #: it may take, on two cores


GROUPS = {
    "ci": Group((LINT, TYPES, TESTS, NOTEBOOKS, DOCUMENTATION), 30),
    "long": Group((LONG,), 90),
    "external": Group((EXTERNAL,), 10),
}


def main(arguments: list[str]) -> int:
    """Run a group of checks from the root of the checkout; return the exit code of the first that fails."""
    if arguments[:1] == ["--campaign"]:
        from tests.campaign import main as campaign

        return campaign(arguments[1:])
    names = [argument.removeprefix("--") for argument in arguments] or ["ci"]
    if len(names) > 1 or names[0] not in GROUPS:
        choices = ", ".join(f"--{name}" for name in (*GROUPS, "campaign"))
        print(f"python -m tests: expected one of {choices}, or nothing for --ci; got {' '.join(arguments)}")
        return 2
    group, begun = GROUPS[names[0]], time.monotonic()
    code = run(group)
    minutes = (time.monotonic() - begun) / 60
    verdict = "all checks passed" if code == 0 else f"failed with exit code {code}"
    over = f", OVER its budget of {group.minutes:g}" if minutes > group.minutes else f" of {group.minutes:g}"
    print(f"\n== group {names[0]}: {verdict}; {minutes:.1f} minutes{over}", flush=True)
    return code


def run(group: Group) -> int:
    """Run the checks of a group up to the first that fails, and return its exit code."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    for name, *command in group.checks:
        print(f"\n== {name}: {' '.join(command)}", flush=True)
        begun = time.monotonic()
        code = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, env=environment, check=False).returncode
        print(f"== {name}: {(time.monotonic() - begun) / 60:.1f} minutes", flush=True)
        if code:
            print(f"== {name} failed with exit code {code}", flush=True)
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
