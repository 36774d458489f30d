"""Compiled functions of all packages: their decorator, their code on disk, and the sources that decide about it."""
