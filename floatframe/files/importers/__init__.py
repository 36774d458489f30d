"""Robots in URDF, read and written: links correspond to bodies, and joints to joints."""
