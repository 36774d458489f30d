"""Bodies that another program has reduced, as our reduced body; what they do not say stays missing and is said so."""
