"""Second order of small deflections: unit loads, geometric stiffness, quadratic modes."""
