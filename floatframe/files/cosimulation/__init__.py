"""Co-simulation by FMI: a system as an FMU for other programs, and FMUs of other programs in a system.

A `Unit` takes communication steps with held inputs and can go back; `write_fmu` packs it as an FMU. `co_simulate` is
the master of a system with the units that its table [fmus.NAME] names.
"""
