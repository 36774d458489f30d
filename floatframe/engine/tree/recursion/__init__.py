"""Recursive equations of trees: inverse and forward dynamics, mass matrix and their derivatives, compiled."""
