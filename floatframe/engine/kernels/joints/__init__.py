"""Rows of joints in the kernels: the formulas of each kind of row, and its derivatives.

`row_formulas` names the functions of each kind. `held_rows` has the constraints and their gradients (the Jacobian),
`wrench_rows` and `loaded_rows` have the rows that define the wrench.
"""
