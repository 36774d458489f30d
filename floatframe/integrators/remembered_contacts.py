"""Forces that depend on the past, which integrators of ordinary differential equations cannot compute."""

from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.model import CONTACT
from floatframe.errors import ModelError

__all__ = ["require_no_remembered_contacts"]


def require_no_remembered_contacts(compiled: CompiledSystem, scheme: str) -> None:
    """Raise `ModelError` with the name of a contact whose force depends on its initial speed."""
    model = compiled.model
    for c, name in enumerate(compiled.connection_names):
        if model.connections.law[c] == CONTACT and model.contacts.dissipation[model.connections.item[c]] > 0:
            raise ModelError(
                f"{scheme}: the force of contact {name!r} depends on its initial speed, which this scheme does not "
                "store; use GeneralizedAlpha, or restitution = 1"
            )
