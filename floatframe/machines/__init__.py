"""Machines ready to copy: TOML files of jobs and systems, a room each, with what reads and judges their motions."""

from floatframe.machines.catalogue import MACHINES, Machine, copy_machine, machine_files

__all__ = ["MACHINES", "Machine", "copy_machine", "machine_files"]
