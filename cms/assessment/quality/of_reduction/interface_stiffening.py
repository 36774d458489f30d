"""Increase of stiffness due to rigid interfaces (RBE2), compared with distributing interfaces (RBE3)."""

from dataclasses import dataclass, replace

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.ports import Ports
from cms.modes.families.families import Families
from cms.reduction.basis.node_results import are_spread
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import Array, frozen

__all__ = ["InterfaceStiffening", "has_both_kinds", "interface_stiffening", "stiffening_record", "with_kind"]

MODES = 6


@dataclass(frozen=True, eq=False)
class InterfaceStiffening:
    """Free body with all its interfaces rigid, compared with all of them distributing."""

    rigid: Array  #: elastic free-free frequencies with rigid interfaces, (n,) [Hz]
    distributing: Array  #: elastic free-free frequencies with distributing interfaces, (n,) [Hz]
    labels: tuple[str, ...]  #: label of each interface motion: 'big_end ux'
    compliance_rigid: Array  #: elastic displacement per unit force along each motion, (6 n_ports,) [m/N, 1/(N m)]
    compliance_distributing: Array

    def __post_init__(self) -> None:
        for name in ("rigid", "distributing", "compliance_rigid", "compliance_distributing"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def frequency_change(self) -> Array:
        """Frequency ratio of rigid to distributing interfaces, minus 1, (n,); nonnegative up to rounding."""
        return self.rigid / self.distributing - 1

    @property
    def compliance_ratio(self) -> Array:
        """Compliance with distributing interfaces divided by that with rigid ones, (6 n_ports,).

        At least 1 except for rounding.
        """
        return self.compliance_distributing / np.where(self.compliance_rigid > 0, self.compliance_rigid, np.nan)


def can_be_both(body: FEBody, interface: Interface) -> bool:
    """Return whether an interface can be rigid or distributing: it needs three nodes that are not collinear."""
    return interface.kind != "nodes" and interface.dofs is None and are_spread(body.nodes[interface.nodes])


def has_both_kinds(body: FEBody) -> bool:
    """Return whether the body has an interface that can be rigid or distributing."""
    return any(can_be_both(body, interface) for interface in body.interfaces)


def with_kind(body: FEBody, kind: str) -> FEBody:
    """Return an uncoupled body in which every interface that can be rigid or distributing has the given kind.

    Interfaces of kind "nodes" do not change, nor do interfaces of beams at one node or on a line.

    Raises
    ------
    QualityError
        If the body is coupled already, or has only interfaces of kind "nodes".
    """
    if body.recovery is not None and body.interfaces and body.is_coupled:
        raise QualityError(f"body {body.name!r}: is coupled already; its interfaces can no longer change kind")
    if not has_both_kinds(body):
        raise QualityError(f"body {body.name!r}: has no rigid or distributing interface to compare")
    interfaces = tuple(replace(i, kind=kind) if can_be_both(body, i) else i for i in body.interfaces)
    return replace(body, interfaces=interfaces)


def interface_stiffening(body: FEBody, *, n_modes: int = MODES) -> InterfaceStiffening:
    """Couple a body in both ways, and compare frequencies and interface compliances.

    A rigid interface adds constraints that a distributing one lacks, so its frequencies are not lower and its
    compliances not higher.

    Parameters
    ----------
    body
        An uncoupled body.
    """
    found = {}
    for kind in ("rigid", "distributing"):
        coupled = couple(with_kind(body, kind))
        ports = Ports.of_body(coupled)
        with Families(coupled) as families:
            frequencies = families.free_modes(n_modes=n_modes).frequencies / body.units.time
            compliance = (ports.A @ families.flexibility(ports.loads())).diagonal()
        found[kind] = (frequencies, compliance, ports.labels)
    rigid, distributing = found["rigid"], found["distributing"]
    return InterfaceStiffening(rigid[0], distributing[0], rigid[2], rigid[1], distributing[1])


def stiffening_record(stiffening: InterfaceStiffening) -> QualityRecord:
    """Return the record "interface-stiffening"."""
    change, ratio = stiffening.frequency_change, stiffening.compliance_ratio
    k, j = int(np.argmax(change)), int(np.nanargmax(ratio))
    reason = (
        f"rigid instead of distributing interfaces raise the frequencies by up to {100 * change[k]:.2g} % "
        f"({stiffening.distributing[k]:.5g} to {stiffening.rigid[k]:.5g} Hz); {stiffening.labels[j]!r} is "
        f"{ratio[j]:.3g} times as compliant when distributing"
    )
    data = {
        "rigid_hz": stiffening.rigid,
        "distributing_hz": stiffening.distributing,
        "labels": stiffening.labels,
        "compliance_ratio": ratio,
    }
    return judge("interface-stiffening", float(change[k]), reason, data)
