"""Evaluation of a fatigue file: curve in units of the body, blocks from results files, spectra from .npz files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cms.body.address import Address
from cms.body.modal_file.file import digest, read
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.fatigue_file import (
    STRESS_UNITS,
    BlockSection,
    FactorSection,
    FatigueFile,
    MaterialSection,
    PlacesSection,
    SpectrumSection,
)
from floatframe.durability.fatigue.history_damage import Progress
from floatframe.durability.fatigue.kernels.cycle_kernels import collect
from floatframe.durability.fatigue.load_blocks import LoadBlock, block_of_results
from floatframe.durability.fatigue.mean_stress import MEAN_STRESS, NO_CORRECTION, MeanStress
from floatframe.durability.fatigue.places import FatigueMaterial, point_number
from floatframe.durability.fatigue.planes import surface_nodes
from floatframe.durability.fatigue.sn_curve import SNCurve, basquin_curve, table_curve
from floatframe.durability.fatigue.spectral.spectra import ModalSpectra
from floatframe.durability.fatigue.surface_damage import FatigueResult, history_damage, spectral_damage
from floatframe.durability.shaking.loads.inputs import input_index
from floatframe.durability.shaking.loads.random_vibration import RandomRun, RandomTest, input_density, spectral_root
from floatframe.durability.shaking.shake import shake
from floatframe.durability.shaking.shake_file import read_shake
from floatframe.durability.shaking.structure.model import ShakenModel, driven, modal_response
from floatframe.errors import FatigueError, ModelError
from floatframe.results.trajectory import Trajectory, read_trajectory

__all__ = ["Assessment", "assess", "equivalent_repeats", "shaken_damage", "shaken_spectra"]


SAME_PLACE = 1e-9  #: distance, relative to the size of the body, within which a stress point is at a node


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Assessment:
    """A fatigue result with its programme.

    Parameters
    ----------
    result
        The damage at the places of the body.
    given
        The fatigue file that was assessed.
    blocks
        Load blocks; empty for spectra.
    """

    result: FatigueResult
    given: FatigueFile
    blocks: tuple[LoadBlock, ...]

    @property
    def life(self) -> Array:
        """Life of each place in the unit of the programme, (n,)."""
        return np.asarray(self.given.programme.amount * self.result.life)


def assess(given: FatigueFile, *, progress: Progress | None = None) -> Assessment:
    """Return the damage for a fatigue file.

    Parameters
    ----------
    given
        The checked content of a fatigue file, from `read_fatigue`.
    progress
        Called with the fraction of the work done, 0 to 1.

    Raises
    ------
    FatigueError, ResultsError, BodyError
        If files do not belong together; also the errors of `history_damage` and `spectral_damage`.
    """
    body = read(given.body)
    materials = [material_of(key, each, given, body) for key, each in given.all_materials.items()]
    section, counting = given.criterion, given.counting
    criterion = Criterion(section.name, section.tensor, section.planes, section.findley_k)
    nodes, points = places_of(given, body)
    if given.spectra:
        stress: Array | None = None
        if given.spectra[0].shake:
            spectra, stress = shaken_of(given, body)
        else:
            spectra = [spectra_of(each) for each in given.spectra]
        result = spectral_damage(
            body, spectra, None, others=materials, method=counting.method, criterion=criterion,
            extrapolate=counting.extrapolate, nodes=nodes, points=points, stress=stress, progress=progress,
        )  # fmt: skip
        return Assessment(result, given, ())
    blocks = [block_of(each, given, body) for each in given.blocks]
    result = history_damage(
        body, blocks, None, others=materials, criterion=criterion, residue=counting.residue,
        negligible=counting.negligible, extrapolate=counting.extrapolate, nodes=nodes, points=points,
        progress=progress,
    )  # fmt: skip
    return Assessment(result, given, tuple(blocks))


def stress_factor(material: MaterialSection, body: ReducedBody) -> float:
    """Return the stress unit of a material divided by the stress unit of the body."""
    units = body.units
    return STRESS_UNITS[material.stress_unit] / units.to_si(mass=1, length=-1, time=-2)


def material_of(key: str, section: MaterialSection, given: FatigueFile, body: ReducedBody) -> FatigueMaterial:
    """Return a material with its curve and strength, in stress units of the body, and its places."""
    curve = curve_of(section, given, body)
    law = mean_stress_of(section, given, body)
    if not isinstance(section, PlacesSection):
        return FatigueMaterial(curve, law, (section.name or "the rest") if given.materials else "")
    curve = with_factors(curve, section.factors, section)
    return FatigueMaterial(curve, law, key.removeprefix("materials."), *places_named(key, section, body))


def curve_of(material: MaterialSection, given: FatigueFile, body: ReducedBody) -> SNCurve:
    """Return an S-N curve in stress units of the body, with the requested survival and all general factors."""
    section, unit = material.sn, stress_factor(material, body)
    table = section.amplitudes if section.amplitudes is not None else section.ranges
    if table is not None:
        half = 1.0 if section.amplitudes is not None else 0.5
        assert isinstance(section.cycles, tuple)
        amplitudes = [half * unit * value for value in table]
        curve = table_curve(section.cycles, amplitudes, below=section.below, stress_ratio=section.stress_ratio)
    else:
        amplitude = section.amplitude if section.amplitude is not None else 0.5 * (section.range or 0.0)
        assert isinstance(section.cycles, float)
        curve = basquin_curve(
            unit * amplitude, section.cycles, section.slope or 0.0, second_slope=section.second_slope,
            below=section.below, stress_ratio=section.stress_ratio, least_cycles=section.least_cycles,
        )  # fmt: skip
    if given.survival is not None:
        curve = curve.for_survival(given.survival, of_curve=section.survival, deviation=section.log_deviation or 0.0)
    return with_factors(curve, given.factors, material)


def with_factors(curve: SNCurve, factors: Mapping[str, float | FactorSection], material: MaterialSection) -> SNCurve:
    """Return a curve with factors on its amplitudes; each factor is a number or a formula."""
    strength = (material.tensile_strength or 0.0) * STRESS_UNITS[material.stress_unit] / 1e6  # [MPa]
    for name, factor in factors.items():
        if isinstance(factor, FactorSection):
            curve = curve.scaled(factor.value(strength), f"factor {name} ({factor.description})")
        else:
            curve = curve.scaled(factor, f"factor {name}")
    return curve


def mean_stress_of(material: MaterialSection, given: FatigueFile, body: ReducedBody) -> MeanStress:
    """Return the correction with its strength in stress units of the body."""
    name = given.criterion.mean_stress
    key = MEAN_STRESS[name][1]
    value = float(getattr(material, key)) if key else 0.0
    if key in ("tensile_strength", "yield_strength", "fatigue_strength_coefficient"):
        value *= stress_factor(material, body)
    return MeanStress(name, value, given.criterion.credit_compression)


def places_named(key: str, section: PlacesSection, body: ReducedBody) -> tuple[IntArray, IntArray]:
    """Return the kept nodes and the stress points of a material."""
    nodes: list[IntArray] = [np.zeros(0, np.int64)]
    points: list[IntArray] = [np.zeros(0, np.int64)]
    for name in section.sets:
        of_nodes, of_points = places_of_set(body, name, f"{key}.sets")
        nodes.append(of_nodes)
        points.append(of_points)
    for element in section.elements:
        triangles = body.numbering.triangles_of_element(f"{key}.elements: body {body.name!r}", element)
        nodes.append(np.unique(body.surface[triangles]))
        points.append(points_of_elements(body, triangles))
    for node in section.nodes:
        nodes.append(Address(node=node).find(body, f"{key}.nodes", of_stress=True).rows)
    known = () if body.point_stress is None else body.point_stress.names
    for begin in section.points:
        found = [k for k, name in enumerate(known) if name == begin or name.startswith(f"{begin} ")]
        if not found:
            has = "it has no stress points" if not known else f"{nearest(begin, known).removeprefix('; ')}"
            raise FatigueError(f"{key}.points: body {body.name!r}: no stress point {quoted(begin)}: {has}")
        points.append(np.array(found, dtype=np.int64))
    of_nodes, of_points = np.unique(np.concatenate(nodes)), np.unique(np.concatenate(points))
    if body.point_stress is not None:
        # nodes between materials have the stress of the stiffest material: border points, if chosen, replace them
        own = body.point_stress.positions[[k for k in of_points if known[k].endswith(" border")]]
        if len(own) and len(of_nodes):
            distance, _ = cKDTree(own).query(body.nodes[of_nodes])
            of_nodes = of_nodes[distance > SAME_PLACE * np.ptp(body.nodes, axis=0).max()]
    return of_nodes, of_points


def places_of_set(body: ReducedBody, name: str, where: str) -> tuple[IntArray, IntArray]:
    """Return the nodes and stress points of a set: the points of its elements, or the points at its nodes."""
    rows = Address(set=name).find(body, where).rows
    named = body.numbering.named_set(f"{where}: body {body.name!r}", name)
    if named.kind == "elements":
        return rows, points_of_elements(body, named.members)
    called = {body.node_name(int(row)) for row in rows}
    known = () if body.point_stress is None else body.point_stress.names
    points = [
        k
        for k, point in enumerate(known)
        if " node " in point and point.rpartition(" node ")[2].rpartition(" ")[0] in called
    ]
    return rows, np.array(points, dtype=np.int64)


def points_of_elements(body: ReducedBody, triangles: IntArray) -> IntArray:
    """Return the stress points of the elements of some triangles, found by the beginning of their names."""
    known = () if body.point_stress is None else body.point_stress.names
    called = {body.numbering.element_name(int(triangle)) for triangle in triangles}
    return np.array([k for k, name in enumerate(known) if element_of_point(name) in called], dtype=np.int64)


def element_of_point(name: str) -> str | None:
    """Return the element in the name of a stress point, "beam 17 end A point 0", "part: shell 21 node 5 top"."""
    words = name.rpartition(": ")[2].split(" ")
    return words[1] if len(words) > 2 and words[0] in ("beam", "shell", "solid") else None


def places_of(given: FatigueFile, body: ReducedBody) -> tuple[IntArray | None, IntArray | None]:
    """Return the nodes and stress points to assess; None for all."""
    wanted, none = given.outputs.places, np.zeros(0, np.int64)
    if wanted == "points" and body.point_stress is None:
        raise FatigueError(
            f"outputs.places: body {body.name!r} has no stress points; reduce it with stress_points in the [body] of "
            "its job"
        )
    if given.outputs.set is None:
        everywhere = np.arange(point_number(body))
        return none if wanted == "points" else None, none if wanted == "nodes" else everywhere
    nodes, points = places_of_set(body, given.outputs.set, "outputs.set")
    nodes = none if wanted == "points" or body.stress is None else np.intersect1d(surface_nodes(body), nodes)
    points = none if wanted == "nodes" else points
    if not len(nodes) + len(points):
        raise FatigueError(f"outputs.set = {given.outputs.set!r}: none of its nodes lies on the surface of the body")
    return nodes, points


def block_of(section: BlockSection, given: FatigueFile, body: ReducedBody) -> LoadBlock:
    """Return the load block of a results file, after checking that it was computed with the body."""
    trajectory = read_trajectory(section.results)
    name = section.name or section.results.stem
    _, entry = trajectory.entry(section.body)
    if entry.digest and entry.digest != digest(given.body):
        raise FatigueError(
            f"block {name!r}: body {section.body!r} of {section.results} was computed with another modal file "
            f"({entry.source}) than {given.body}, or this file has changed since; give the other file, or compute the "
            "motion again"
        )
    if trajectory.units != body.units:
        body_q = body.units.to_si(length=2, mass=1) ** 0.5
        factor = trajectory.units.to_si(length=2, mass=1) ** 0.5 / body_q  # q is a length times the root of a mass
    else:
        factor = 1.0
    repeats = section.repeats
    if section.match is not None:
        repeats *= matched(section, trajectory, name)
    block = block_of_results(
        trajectory, section.body, name=name, repeats=repeats, scale=section.scale, times=section.times,
        has_gaps=section.gaps,
    )  # fmt: skip
    return block if factor == 1 else LoadBlock(name, factor * block.q, block.t, repeats, section.scale, section.gaps)


def matched(section: BlockSection, trajectory: Trajectory, name: str) -> float:
    """Return the number of repeats with which a sensor has the pseudo-damage of a measured signal in a block."""
    from floatframe.files.signals.read_signals import read_signals
    from floatframe.files.system_file.recorded_system import recorded_system
    from floatframe.results.sensors import measurement_of

    match = section.match
    assert match is not None
    system = recorded_system(trajectory)
    if system is None:
        raise FatigueError(
            f"block {name!r}: match: the system file of {section.results}, which defines its sensors, does not exist "
            "any more"
        )
    found = measurement_of(system, trajectory, match.sensor)
    chosen = np.ones(len(trajectory.t), bool)
    if section.times is not None:
        chosen = (trajectory.t >= section.times[0]) & (trajectory.t <= section.times[1])
    (column,) = found.columns
    signal = read_signals(match.measured)[match.signal]
    unit = found.units[column]
    values = signal.values if not signal.unit or signal.unit == unit else signal.to(unit).values
    return equivalent_repeats(values, section.scale * found.columns[column][chosen], match.slope)


def equivalent_repeats(measured: Array, simulated: Array, slope: float) -> float:
    """Return the number of repeats with which a simulated history has the pseudo-damage of a measured one.

    Pseudo-damage is the sum of n (range / 2)^slope over the rainflow cycles of the repeated history.

    Parameters
    ----------
    measured, simulated
        Histories of the same quantity, (n_t,), in one unit.
    slope
        Exponent of the pseudo-damage, at least 1.

    Raises
    ------
    FatigueError
        If one of them has gaps or does not vary, or the slope is below 1.
    """
    if not slope >= 1:
        raise FatigueError(f"equivalent repeats: slope: expected 1 or more, got {slope:g}")
    sums = []
    for name, history in (("measured", measured), ("simulated", simulated)):
        values = np.ascontiguousarray(history, dtype=float)
        if values.ndim != 1 or not np.isfinite(values).all():
            raise FatigueError(f"equivalent repeats: {name} history: expected finite numbers (n_t,)")
        cycles = collect(values, True)
        sums.append(float(cycles[:, 2] @ (0.5 * np.abs(cycles[:, 0] - cycles[:, 1])) ** slope))
        if sums[-1] == 0:
            raise FatigueError(f"equivalent repeats: the {name} history does not vary")
    return sums[0] / sums[1]


def shaken_of(given: FatigueFile, body: ReducedBody) -> tuple[list[ModalSpectra], Array]:
    """Return the spectra of the runs of a random test of a shake file, and the stress over their coordinates."""
    (section,) = given.spectra
    assert section.shake is not None and section.test is not None  # noqa: PT018
    job = read_shake(section.shake)
    if digest(job.source) != digest(given.body) or job.structure.units != body.units:
        raise FatigueError(
            f"{section.shake}: expected a test of {given.body} in the units of that file, got {job.source} in "
            f"{job.structure.units.name}"
        )
    tests = {test.name: test for test in job.random}
    if section.test not in tests:
        raise FatigueError(f"{section.shake}: no random test {quoted(section.test)}{nearest(section.test, tests)}")
    test = tests[section.test]
    duration = section.duration if section.duration is not None else test.duration
    if duration is None:
        raise FatigueError(f"{section.shake}: the duration of random.{test.name} is not known; give it in [[spectra]]")
    made = shake(replace(job, sine=(), random=(test,), shock=(), notch=(), outputs=()))
    found = [shaken_spectra(made.model, test, run, duration) for run in made.random]
    return [replace(each, repeats=section.repeats, scale=section.scale) for each, _ in found], found[0][1]


def spectra_of(section: SpectrumSection) -> ModalSpectra:
    """Return the spectra of an .npz file."""
    assert section.file is not None
    name = section.name or section.file.stem
    try:
        with np.load(section.file, allow_pickle=False) as file:
            content: dict[str, Any] = {key: file[key] for key in file.files}
    except (OSError, ValueError, EOFError, KeyError) as error:
        raise FatigueError(f"{section.file}: expected an .npz file of arrays: {error}") from None
    missing = {"frequencies", "spectra"} - set(content)
    if missing:
        raise FatigueError(
            f"{section.file}: expected the arrays frequencies (n_f,) and spectra (n_f, n_q, n_q), one-sided, "
            f"optionally duration and mean; {', '.join(sorted(missing))} missing"
        )
    duration = section.duration if section.duration is not None else content.get("duration")
    if duration is None or np.size(duration) != 1:
        raise FatigueError(f"{section.file}: the duration is not known; give it in [[spectra]]: duration = seconds")
    return ModalSpectra(
        name, content["frequencies"], content["spectra"], float(np.asarray(duration).reshape(())), content.get("mean"),
        section.repeats, section.scale,
    )  # fmt: skip


# damage of a shaken body: the random test of `floatframe shake` gives the cross spectra of its modes ------------------
# The coordinates are the modes with fixed bases, eta, and the motions of the inputs. The field of the model is their
# stress at kept nodes and stress points. Their cross spectra G = H S H^H are exact at the frequencies of the run, and
# integrals use the weights of the run.


def shaken_spectra(model: ShakenModel, test: RandomTest, run: RandomRun, duration: float) -> tuple[ModalSpectra, Array]:
    """Return the cross spectra of modes and inputs in a random run, and their stress at all places, (n, 6, n_q).

    Places: the kept nodes, then the stress points.

    Raises
    ------
    FatigueError
        If the body of the model has no stress.
    """
    if model.field is None:
        raise FatigueError(f"shaken body {model.name!r}: it has no stress of the modes; reduce it with stress = true")
    columns = [model.inputs.index(name) for name in run.inputs]
    where = f"shake: random {test.name!r}"
    levels = {input_index(model, name, where): (name, level) for name, level in (test.levels or {}).items()}
    acting = {k: levels[k] if test.level is None else (model.inputs[k], test.level) for k in columns}
    f = run.band.frequencies
    eta, omega = modal_response(model, f)
    of_modes, of_inputs = model.field
    if of_inputs[:, :, columns].any():  # otherwise the motion of the bases causes no stress by itself
        unit = np.zeros((3, len(model.inputs), len(model.inputs)))
        unit[0] = np.eye(len(model.inputs))
        eta = np.concatenate([eta, driven(unit, model.rates, omega)], axis=1)
        of_modes = np.concatenate([of_modes, of_inputs], axis=2)
    moved = eta[:, :, columns] @ spectral_root(input_density(model, test, acting, f))
    G = np.asarray(moved @ moved.conj().transpose(0, 2, 1), dtype=np.complex128)
    return ModalSpectra(f"{run.test} {run.direction}", f, G, duration, weights=run.band.weights), of_modes


def shaken_damage(
    body: ReducedBody,
    model: ShakenModel,
    test: RandomTest,
    runs: Sequence[RandomRun],
    curve: SNCurve,
    *,
    duration: float | None = None,
    method: str = "dirlik",
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
) -> FatigueResult:
    """Return the damage on the surface of a shaken body, summed over the runs of a random test.

    Parameters
    ----------
    body
        The body that was shaken.
    model
        The shaken structure, of which the body is a part.
    test
        The random test.
    runs
        Its runs, one for each direction.
    curve
        S-N curve in stress units of the body; amplitudes, not ranges.
    duration
        Duration of each run [s]; None: the duration of the test.
    method
        One of `SPECTRAL_METHODS`.
    criterion
        Scalar that is counted at a place, from the stress there.
    mean_stress
        Correction for the static mean stress.
    extrapolate
        As for `spectral_damage`.
    nodes
        Kept nodes to assess; None: all on the surface.

    Raises
    ------
    FatigueError
        If no duration is known, or the runs belong to another test; also the errors of `spectral_damage`.
    """
    chosen = [run for run in runs if run.test == test.name]
    lasts = duration if duration is not None else test.duration
    if lasts is None or not chosen:
        what = "expected one of its runs, got none" if not chosen else "its duration is not known; give duration"
        raise FatigueError(f"random test {test.name!r}: {what}")
    made = [shaken_spectra(model, test, run, lasts) for run in chosen]
    return spectral_damage(
        body, [each for each, _ in made], curve, method=method, criterion=criterion, mean_stress=mean_stress,
        extrapolate=extrapolate, nodes=nodes, stress=made[0][1],
    )  # fmt: skip
