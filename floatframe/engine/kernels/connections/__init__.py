"""Kernels of connections between markers: joints, springs, bushings, contacts, couplers, user forces."""
