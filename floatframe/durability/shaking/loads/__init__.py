"""Tests: levels, sine, random, shocks and transients, uncertainty, and notches in the input."""
