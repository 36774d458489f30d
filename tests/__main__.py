"""Every check of the project in one command: `python -m tests` (`--long` adds the studies of minutes).

Lint, types, tests, notebooks, documentation, in this order; each prints its own report, the first failure ends the run.
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main() -> int:
    """Run the checks from the root of the checkout; return the exit code of the first that fails."""
    markers = [] if "--long" in sys.argv[1:] else ["-m", "not long"]
    checks = {
        "lint": ["ruff", "check", "."],
        "types": ["mypy"],
        "tests": ["pytest", "-q", *markers, "tests"],
        "notebooks": ["pytest", "-q", "--nbmake", "--nbmake-timeout=300", "-o", "filterwarnings=", "notebooks"],
        "documentation": ["sphinx", "-W", "--keep-going", "-q", "-b", "html", "docs", "build/site"],
    }
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    for name, command in checks.items():
        print(f"\n== {name}: {' '.join(command)}", flush=True)
        code = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, env=environment, check=False).returncode
        if code:
            print(f"== {name} failed with exit code {code}", flush=True)
            return code
    print("\n== all checks passed", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
