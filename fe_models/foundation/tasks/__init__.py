"""Many values of one function: here, in processes beside, or on a Dask cluster; a journal of what is done.

Work that is interrupted by its user ends (`interrupts`).
"""
