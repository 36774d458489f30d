"""Compiled functions of one connection of each kind over a step: bushings, contacts, couplers, rolling, user forces."""
