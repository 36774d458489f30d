"""Compiled functions for one connection over a step: bushings, contacts, couplers, rolling, user forces."""
