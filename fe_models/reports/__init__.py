"""What a mesh or a frame looks like before it is reduced: counts, quality, units, findings."""
