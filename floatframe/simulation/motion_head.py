"""The description of a motion in its results: the head, and the datasets of a motion in memory."""

from dataclasses import asdict
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from fe_models.foundation.paths import file_digest, file_state
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.integrators.integrator import Integrator
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.forces import BodyLoad, PointForce
from floatframe.model.system import System
from floatframe.results.head import BodyEntry, Head
from floatframe.results.sensors import sensor_points
from floatframe.results.writer import arrays_of
from floatframe.simulation.restart import system_digest

__all__ = ["head_of", "joint_rows"]


def joint_rows(system: System, kept: list[Rows]) -> dict[str, np.ndarray]:
    """Return the datasets of a motion that is kept in memory."""
    arrays = arrays_of(kept)
    arrays["drift"] = arrays["drift"][:, : len(compiled_system(system).joint_names)]
    return arrays


def head_of(system: System, integrator: Integrator, t_start: float, t_end: float, h: float, every: int) -> Head:
    """Return the head for the results of a run."""
    compiled = compiled_system(system)
    entries = []
    sources = [body.source if isinstance(body, FlexibleBody) else "" for body in system.bodies]
    digests = {source: digest_of(source) for source in set(sources)}  # files of many bodies are read once
    for i, (body, source) in enumerate(zip(system.bodies, sources, strict=True)):
        entries.append(
            BodyEntry(
                body.name,
                int(compiled.model.bodies.n_q[i]),
                int(compiled.model.bodies.q0[i]),
                int(compiled.model.bodies.u0[i]),
                source,
                digests[source],
                isinstance(body, FlexibleBody) and body.is_stiffened,
            )
        )
    run = {
        "integrator": type(integrator).__name__,
        **asdict(integrator),  # type: ignore[call-overload]
        "t_start": t_start,
        "t_end": t_end,
        "h": h,
        "output_every": every,
        "gravity": [float(x) for x in compiled.model.gravity],
        "system_file": system.source,
        "system_file_digest": file_digest(system.source),
        "changes": dict(system.changes),
        "digest": system_digest(system, integrator),
        "floatframe": release(),
    }
    return Head(
        system.name,
        system.units.name,
        tuple(entries),
        compiled.joint_names,
        compiled.spring_names,
        tuple(int(k) for k in compiled.model.connections.w0),
        run,
        places=sensor_points(system),
        loads=tuple(force.name for force in system.forces if isinstance(force, PointForce)),
        load_cases=tuple(force.name for force in system.forces if isinstance(force, BodyLoad)),
    )


def digest_of(source: str) -> str:
    """Return the digest of a modal file, or "" for a body that was created in memory."""
    if not source:
        return ""
    return digest_of_state(source, file_state(source))


@lru_cache(maxsize=64)  # many runs have bodies of the same files
def digest_of_state(source: str, _: tuple[int, ...] | None) -> str:
    """Return the digest of a modal file in a state, see `file_state`."""
    from cms.body.modal_file.file import digest

    return digest(source)


@cache
def release() -> str:
    """Return the version of the installed program."""
    try:
        return version("floatframe")
    except PackageNotFoundError:
        return "unknown"
