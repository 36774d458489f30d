"""Memory of a reduction: an estimate before the work, and a limit."""
