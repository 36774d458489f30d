"""Tests: levels, sine, random, shocks and transients, uncertainty, and notches in what is applied."""
