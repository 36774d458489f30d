"""`python -m floatframe.cli` is equivalent to the command `floatframe`, if its script is not on the path."""

from floatframe.cli import main

main()
