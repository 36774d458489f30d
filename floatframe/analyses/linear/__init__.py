"""Small motions about an equilibrium or a steady rotation: channels, linearisation, modes, responses, state spaces."""
