"""From a mode set to the basis of a reduced body: rank, frame, moments, stress, damping."""
