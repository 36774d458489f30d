"""Steps of the conserving, decaying and variational schemes in compiled loops; formulas as in the room above."""
