"""The acceptance document of a reduced body: every check, its origin, and its range of use."""
