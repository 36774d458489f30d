"""`python -m cms.cli` runs the command `cms` if its script is not on the path."""

from cms.cli import main

main()
