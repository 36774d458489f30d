"""How much memory a reduction takes, told before the work, and kept within what it may take."""
