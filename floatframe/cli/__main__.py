"""`python -m floatframe.cli` is the command `floatframe`, where its script is not on the path."""

from floatframe.cli import main

main()
