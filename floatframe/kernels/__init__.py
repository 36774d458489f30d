"""Compiled kernels: the only modules that import numba; import them only when a motion is computed.

Inner functions are compiled with the entry that calls them and not cached on their own (compiler/compilation.py);
entries are cached on disk.
numba checks only the file of a cached function for changes, so each entry holds the digest of all sources of this
folder in a closure, which makes it part of the key of its cache: no entry is ever run with stale inner functions.
"""

import hashlib
from pathlib import Path

__all__ = ["source_digest"]


def source_digest() -> int:
    """Return a number that changes with the source of any kernel."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big") + 1
