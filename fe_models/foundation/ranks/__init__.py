"""Several processes (ranks) that work on one body together: a single process, or processes under MPI."""
