"""Compiled recursive equations of trees: inverse and forward dynamics, mass matrix, and derivatives."""
