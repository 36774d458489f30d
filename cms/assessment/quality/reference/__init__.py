"""Full model as the reference: its modes, responses and motions, computed once."""
