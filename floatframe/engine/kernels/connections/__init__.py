"""Kernels of what acts between markers: joints, springs, bushings, contacts, couplers, user forces."""
