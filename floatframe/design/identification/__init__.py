"""Inertial parameters of trees: linear forms, base parameters, exciting motions, estimation from measurements."""
