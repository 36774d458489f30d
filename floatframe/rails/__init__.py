"""Wheel on rail: profiles, where they touch, the normal force and the creep forces, tracks and their irregularities.

Profiles from standards, cones and points; Hertz's ellipse; Kalker's, Polach's and FASTSIM's creep forces; equivalent
conicity; the elements `rails.wheelset` and `rails.wheel-on-rail` (docs/rails.md).
"""
