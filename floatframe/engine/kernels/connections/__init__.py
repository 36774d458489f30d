"""The laws of connections between markers in a step: springs, bushings, contacts, couplers, user forces.

`connection` evaluates a connection of any kind; joints have their rows in `floatframe.engine.kernels.joints`.
"""
