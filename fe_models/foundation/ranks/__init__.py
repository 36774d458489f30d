"""Several processes that work on one body together: what they are, alone or under MPI."""
