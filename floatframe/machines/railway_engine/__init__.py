"""A railway engine over a rail defect and through an S-curve: files, wheel paths, comparison with the full model."""
