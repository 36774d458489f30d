"""Exchange: reduced bodies of other programs, read and written."""
