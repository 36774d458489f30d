"""Compiled kernels: the only modules that import numba; import them only when a motion is computed.

Inner functions become machine code with the entry that calls them (kernels/compiler/lean.py); entries are cached on
disk. So is the intermediate code of each inner function, under a key of everything that decides about it
(kernels/compiler/stored.py): an entry that is compiled again reads the functions that did not change.
numba checks only the file of a cached function for changes, so each entry holds the digest of its own source and of
all modules that it imports, near and far (kernels/compiler/sources.py), in a closure, which makes it part of the key of
its cache: no entry is ever run with stale inner functions.
"""
