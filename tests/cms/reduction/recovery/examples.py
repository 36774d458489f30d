"""Systems, bodies and helpers that several tests share: matrices."""

from functools import cache

import cms
from fe_models.body.fe_body import FEBody
from tests.bodies import bar

LENGTH, WIDTH, HEIGHT = 1.0, 0.05, 0.04
NODES = (10, 31)
STATIC_ROWS = (cms.reduction.Rows("stress", at=NODES), cms.reduction.Rows("strain", at=NODES[:1]))
POINT = (0.2, -0.3, 0.1)
ROWS = (
    *STATIC_ROWS,
    cms.reduction.Rows("displacement", at=("right", *NODES)),
    cms.reduction.Rows("velocity", at=NODES[:1]),
    cms.reduction.Rows("acceleration", at=("right", *NODES)),
    cms.reduction.Rows("net force", about=POINT),
)
OF_INTERFACES = (
    cms.reduction.Rows("interface force"),
    cms.reduction.Rows("net force", at=("left", "right"), about=POINT),
)


@cache
def full() -> FEBody:
    return cms.couple(bar(nx=4, length=LENGTH, width=WIDTH, height=HEIGHT))


@cache
def reduced(modes: str = "craig-bampton", frame: str = "tisserand") -> cms.ReducedBody:
    made = {
        "craig-bampton": lambda: cms.craig_bampton(full(), n_modes=4),
        "normal": lambda: cms.modes.normal_modes(full(), n_modes=8),
    }[modes]()
    frames = {
        "tisserand": cms.TisserandFrame(),
        "turned": cms.TisserandFrame(axes=((0, 0.6, 0.8), (0, -0.8, 0.6), (1, 0, 0)), origin=(0.1, 0.2, -0.3)),
        "nodal": cms.NodalFrame("left"),
    }
    rows = (*ROWS, *(OF_INTERFACES if modes == "craig-bampton" else ()))
    request = cms.reduction.RecoveryRequest("all", rows, loads_at=(20,))
    return cms.reduce(full(), made, frame=frames[frame], recovery=request, damping=cms.reduction.ModalDamping(0.02))
