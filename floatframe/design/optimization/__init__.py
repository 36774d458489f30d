"""Optimisation of a system by parameters of its file: fits to tables, peaks, frequencies and damping, with limits."""
