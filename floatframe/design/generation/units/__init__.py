"""Generated equations as an FMU for other programs: compiled C code without dependencies."""
