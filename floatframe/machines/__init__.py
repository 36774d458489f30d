"""Machines ready to copy: TOML files of jobs and systems, each in its own room with functions to evaluate them."""

from floatframe.machines.catalogue import MACHINES, Machine, copy_machine, machine_files, parameters_of

__all__ = ["MACHINES", "Machine", "copy_machine", "machine_files", "parameters_of"]
