"""A railway engine over a rail defect and through an S-curve: files, paths of the wheels, the full model beside it."""
