"""`python -m cms.cli` is the command `cms`, where its script is not on the path."""

from cms.cli import main

main()
