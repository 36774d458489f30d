"""Reports about a mesh or a frame before its reduction: counts, quality, units, findings."""
