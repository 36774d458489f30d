"""Generated equations as a unit for other programs: an FMU of compiled C that needs nothing where it runs."""
