"""Second-order effects of small deflections: unit loads, geometric stiffness, quadratic modes."""
