"""Element formulations: solids, shells and beams, and the recovery of their stress, strain and forces."""
