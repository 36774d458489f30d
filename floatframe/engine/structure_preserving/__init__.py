"""One step of every body and joint between two configurations, for conserving and variational schemes.

Coordinates of a body: its centre of mass c, R_GB, q. All functions take stacks of steps along leading axes, and complex
numbers, so that derivatives are exact by a step along the imaginary axis (docs/integrators.md).
"""
