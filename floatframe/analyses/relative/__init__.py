"""Analyses in the coordinates of joints: small motions that have names, equilibria and driven motions along a tree."""
