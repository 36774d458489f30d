"""Evaluations one after the other, with the tables that the kernels take made once.

A call of the kernels makes a table of addresses for each record it is handed and an order of some twenty arrays, which
takes longer than a small system does. Here they are made once for a system and its working arrays; an evaluation writes
three numbers and runs.
"""

from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work

__all__ = ["Evaluation", "evaluation_of"]

KEPT = 4  #: evaluations of the last systems


class Evaluation:
    """Residuals and derivatives of a system for the iterate in its working arrays."""

    def __init__(self, model: Model, work: Work) -> None:
        from floatframe.engine.kernels import entry
        from floatframe.engine.kernels.compiler.structure import table_of
        from floatframe.engine.kernels.records import filled

        if not entry.run.signatures:
            entry.prepare()
        self.run, self.model, self.work = entry.run, model, work
        self.order = filled(entry.Order(), **(entry.NOTHING._asdict() | {"what": entry.LINEARIZE}))
        self.memory = entry.no_memory()
        records = (model, work, self.memory, entry.NO_ROWS, self.order)  # all live as long as this
        self.tables = tuple(table_of(record) for record in records)

    def evaluate(self, c_m: float, c_d: float, c_k: float) -> None:
        """Write residuals and derivatives, as `floatframe.engine.kernels.entry.evaluate_and_linearize` does."""
        order = self.order
        order.c_m[...], order.c_d[...], order.c_k[...] = c_m, c_d, c_k
        self.run(*self.tables)


kept: list[Evaluation] = []


def evaluation_of(model: Model, work: Work) -> Evaluation:
    """Return the evaluation of a system with its working arrays, from those that are kept."""
    for known in kept:
        if known.model is model and known.work is work:
            return known
    made = Evaluation(model, work)
    kept.insert(0, made)
    del kept[KEPT:]
    return made
