"""The structure that is shaken: interfaces eliminated, modes with the bases held, damping, places observed."""
