"""Evaluation of one function at many values: in this process, in local processes, or on a Dask cluster.

A journal records finished values. Ctrl-C interrupts the work reliably (`interrupts`).
"""
