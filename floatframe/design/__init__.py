"""Design: sweeps, optimisation, sensitivities, identification, generated code and the laboratory."""
