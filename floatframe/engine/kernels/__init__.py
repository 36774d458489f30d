"""Compiled kernels: the only modules that import numba; import them only when a motion is computed.

Inner functions become machine code with the entry that calls them (kernels/compiler/lean.py); entries are cached on
disk. The intermediate code of each inner function is cached too, under a key of everything on which it depends
(kernels/compiler/stored.py), so that an entry that is compiled again reads the functions that have not changed.

numba checks only the file of a cached function for changes. Therefore each entry has in its closure a digest of its own
source and of all modules that it imports directly or indirectly (kernels/compiler/sources.py). numba includes the
closure in the key of its cache, so that no entry is ever run with stale inner functions.
"""
