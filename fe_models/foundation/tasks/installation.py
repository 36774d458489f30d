"""Version of the project, and of libraries that affect results, in a process; workers must match the caller."""

import hashlib
import platform
from functools import cache
from importlib import metadata
from pathlib import Path

__all__ = ["differences", "installation", "source_mark"]

ROOT = Path(__file__).parents[3]  #: folder of the packages
PACKAGES = ("fe_models", "cms", "floatframe")
LIBRARIES = ("numpy", "scipy", "numba", "h5py")


@cache
def source_mark() -> str:
    """Return twelve digits of the digest of all sources of the project; equal for a checkout and its installation."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            text = path.read_bytes().replace(b"\r\n", b"\n")
            digest.update(repr((path.relative_to(ROOT).as_posix(), len(text))).encode() + text)
    return digest.hexdigest()[:12]


@cache
def installation() -> dict[str, str]:
    """Return the versions of this project, Python and the libraries, by name."""
    found = {"project": f"{version('floatframe')} (sources {source_mark()})", "python": platform.python_version()}
    return found | {name: version(name) for name in LIBRARIES}


def version(name: str) -> str:
    """Return the version of an installed distribution."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def differences(expected: dict[str, str], got: dict[str, str]) -> str:
    """Describe how two installations differ; "" if they do not."""
    names = [name for name in expected if expected[name] != got.get(name)]
    return "; ".join(f"{name}: expected {expected[name]}, got {got.get(name, 'none')}" for name in names)


def __getattr__(name: str) -> dict[str, str]:
    """Compute INSTALLATION in the process that asks; another process can be asked for it by this name."""
    if name == "INSTALLATION":
        return installation()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
