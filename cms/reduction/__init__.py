"""Reduction: from a body and a mode set to a reduced body in its body frame, with geometric stiffness and recovery."""
