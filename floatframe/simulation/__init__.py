"""The time loop (`integrate`) with its events, its restart, and the checks of step size and linear frames."""
