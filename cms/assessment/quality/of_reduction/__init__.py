"""How a mode set compares with its full model."""
