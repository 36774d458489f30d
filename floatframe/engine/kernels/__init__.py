"""Compiled kernels: the only modules that import numba; import them only when a motion is computed.

Inner functions become machine code with the entry that calls them (kernels/compiler/lean.py); entries are cached on
disk. The intermediate code of each inner function is cached too, under a key of everything on which it depends
(kernels/compiler/stored.py), so that an entry that is compiled again reads the functions that have not changed.

Entries are stored under keys that change with their own source and with all modules that it imports, directly or
indirectly (fe_models/foundation/kernels), so that no entry is ever run with stale inner functions.
"""
