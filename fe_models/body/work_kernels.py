"""Compiled products of fields at points; imported only where used."""

from fe_models.foundation.kernels.jit import jit_with

__all__ = ["work_products"]

jit_fast = jit_with(fastmath={"contract", "reassoc", "nsz"})


@jit_fast
def work_products(fields, unit, row, column, value, products):
    """Write fieldsᵀ U_r fields for all pairs of columns k <= l at every point, (n_points, n_units, n_pairs).

    fields is (n_points, c, n). U_r is symmetric, (c, c), given by entries (unit r, row <= column, value), (n_entries,)
    each.
    """
    n = fields.shape[2]
    for p in range(fields.shape[0]):
        products[p] = 0.0
        for e in range(unit.size):
            f, g, u = fields[p, row[e]], fields[p, column[e]], value[e]
            at = 0
            for k in range(n):
                out = products[p, unit[e], at : at + n - k]
                a, b = u * f[k], u * g[k]
                F, G = f[k:], g[k:]
                if row[e] == column[e]:
                    for m in range(n - k):
                        out[m] += a * F[m]
                else:
                    for m in range(n - k):
                        out[m] += a * G[m] + b * F[m]
                at += n - k
