"""Bodies reduced by another program, as our reduced bodies; data that they lack are marked as missing."""
