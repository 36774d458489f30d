"""Commands that vary or find parameters: sweeps, studies, optimisation, gradients, identification."""
