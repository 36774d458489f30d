"""A shake result as a record in plain types, with or without long curves, and as a table; accelerations are in g."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table
from floatframe.durability.shaking.loads.notching import NotchedRun
from floatframe.durability.shaking.loads.random_vibration import RandomRun
from floatframe.durability.shaking.loads.shock import TimeRun
from floatframe.durability.shaking.loads.sine import SineRun
from floatframe.durability.shaking.shake import ShakeResult
from floatframe.durability.shaking.structure.model import Output, ShakenModel

__all__ = [
    "COLUMNS", "MOST_NUMBERS", "ROUNDING", "conversions", "in_tables", "light_record", "run_title", "shake_record",
    "shake_table", "size_of_curves", "table_rows", "worst_nodes",
]  # fmt: skip

FEW = 50  #: length of a list above which it is a curve
MOST_NUMBERS = 300_000  #: largest number of values in curves that remain in the record, about three megabytes
DIGITS = 7  #: number of digits of the values of a curve

ROUNDING = 1e-9  #: value, relative to the largest output of its kind, below which it is a rounding error
COLUMNS = (
    "test",
    "kind",
    "direction",
    "output",
    "place",
    "unit",
    "value",
    "what",
    "at",
    "with uncertainty",
    "three sigma",
    "quasi-static",
    "swept",
    "notched",
)
WORST = 20  #: number of nodes in the table of largest stresses


def in_tables(model: ShakenModel, output: Output) -> tuple[float, str]:
    """Return the factor from units of the model to those of the tables, and their unit: g for accelerations."""
    return (1 / model.gravity, "g") if output.kind == "acceleration" else (1.0, output.unit)


def conversions(model: ShakenModel) -> list[str]:
    """Return notes on one g and one Hz in units of the model."""
    units = model.units
    length, second = units.length_symbol, units.time_symbol
    said = [
        f"units of the model: {units.name} ({length}, {units.mass_symbol}, {second}, force {units.force_symbol}, "
        "stress "
        f"{units.stress_symbol})",
        f"1 g = 9.80665 m/s² = {model.gravity:.9g} {length}/{second}²; 1 g²/Hz = {model.gravity**2:.9g} "
        f"({length}/{second}²)²/Hz",
        "frequencies in Hz = 1/s" + (f"; the model's unit of time is {units.time:g} s" if units.time != 1 else ""),
        "accelerations in g, all others in units of the model; forces are those of the base on the structure",
    ]
    return said


def shake_record(result: ShakeResult) -> dict[str, Any]:
    """Return the complete result except full time histories: conversions, modes, masses, and runs with their curves."""
    model = result.model
    masses = result.masses
    return {
        "format": "floatframe shake",
        "title": result.job.title,
        "structure": model.name,
        "source": result.job.source,
        "units": {"name": model.units.name, "conversions": conversions(model), "g": model.gravity},
        "bases": [
            {"name": base.name, "holds": list(base.holds), "point": plain(base.point), "axes": plain(base.axes)}
            for base in model.bases
        ],
        "damping": result.job.damping.description,
        "uncertainty": result.job.uncertainty.description,
        "notes": list(result.notes),
        "mass_matrix": plain(model.mass),
        "modes": [
            {
                "mode": k + 1,
                "frequency_hz": float(masses.frequencies[k]),
                "damping_ratio": float(masses.damping[k]),
                "is_static": bool(k >= len(model.omega) - model.n_residual),
                "effective_mass": plain(masses.mass[k]),
                "share": plain(masses.share[k]),
                "cumulative": plain(masses.cumulative[k]),
            }
            for k in range(len(masses.frequencies))
        ],
        "mass_directions": list(masses.directions),
        "sine": [sine_record(model, run) for run in result.sine],
        "random": [random_record(model, run) for run in result.random],
        "time": [time_record(model, run) for run in result.time],
        "notched": [
            {"kind": kind, "test": test, "direction": direction, **notched_record(model, kind, run)}
            for (kind, test, direction), run in result.notched.items()
        ],
    }


def plain(values: Array) -> Any:
    """Return numbers as lists, with None for values that are not finite, and `DIGITS` digits in curves."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 2 and array.shape[1] > FEW and np.isfinite(array).all():
        return [[float(f"{value:.{DIGITS}g}") for value in row] for row in array.tolist()]
    listed = array.tolist()
    if np.isfinite(array).all():
        return listed
    return [plain(each) for each in array] if array.ndim > 1 else [v if np.isfinite(v) else None for v in listed]


def output_records(model: ShakenModel, outputs: tuple[Output, ...]) -> list[dict[str, str]]:
    """Return name, kind, unit and place of outputs."""
    return [{"name": o.name, "kind": o.kind, "unit": in_tables(model, o)[1], "place": o.place} for o in outputs]


def factors(model: ShakenModel, outputs: tuple[Output, ...]) -> Array:
    """Return the factors to the units of the tables, (n_out,)."""
    return np.array([in_tables(model, output)[0] for output in outputs])


def sine_record(model: ShakenModel, run: SineRun) -> dict[str, Any]:
    """Return a sine run."""
    scale = factors(model, run.outputs)
    record = {
        "test": run.test,
        "direction": run.direction,
        "outputs": output_records(model, run.outputs),
        "frequencies_hz": plain(run.frequencies),
        "level": plain(run.level * level_scale(model, run.direction)),
        "amplitudes": plain((run.sizes * scale).T),
        "with_uncertainty": plain((run.uncertain * scale).T),
        "quasi_static": plain((run.static * scale).T),
    }
    if run.swept is not None:
        record |= {"rate_octaves_per_minute": run.rate, "swept_frequencies_hz": plain(run.swept_frequencies)}
        record["swept"] = plain((run.swept * scale).T)
    return record


def level_scale(model: ShakenModel, direction: str) -> float:
    """Return the factor of a level from the model to the tables: to g for accelerations, 1 for rotations."""
    return 1.0 if direction.rpartition(":")[2].startswith("r") else 1 / model.gravity


def random_record(model: ShakenModel, run: RandomRun) -> dict[str, Any]:
    """Return a random run."""
    scale = factors(model, run.outputs)
    own = np.array([level_scale(model, name) for name in run.inputs])
    return {
        "test": run.test,
        "direction": run.direction,
        "inputs": list(run.inputs),
        "input_rms": plain(run.input_rms * own),
        "outputs": output_records(model, run.outputs),
        "frequencies_hz": plain(run.band.frequencies),
        "level": plain((run.level * own**2).T),
        "densities": plain((run.density * scale**2).T),
        "rms": plain(run.rms * scale),
        "integration_error": plain(run.error),
        "rms_with_uncertainty": plain(run.uncertain * scale),
        "zero_crossings_hz": plain(run.crossings),
        "largest_expected": None if run.expected is None else plain(run.expected * scale),
        "von_mises": {
            name: {"rms": one.rms, "not_exceeded_99.73_percent": one.quantile, "over_rms": one.factor}
            for name, one in run.von_mises.items()
        },
        "miles": [
            {
                "mode": m.mode,
                "frequency_hz": m.frequency,
                "Q": m.Q,
                "g2_per_hz": m.density,
                "grms": m.grms,
                "mass_share": m.share,
            }
            for m in run.miles
        ],
        "worst_nodes": [{"node": name, "von_mises_rms": value} for name, value in worst_nodes(model, run)],
    }


def worst_nodes(model: ShakenModel, run: RandomRun) -> list[tuple[str, float]]:
    """Return the nodes with the largest rms of von Mises' stress, the largest first."""
    if run.field is None:
        return []
    order = np.argsort(-run.field)[:WORST]
    return [(model.field_labels[k], float(run.field[k])) for k in order]


def time_record(model: ShakenModel, run: TimeRun) -> dict[str, Any]:
    """Return a run over time: peaks and spectra."""
    scale = factors(model, run.outputs)
    return {
        "test": run.test,
        "kind": run.kind,
        "what": run.words,
        "direction": run.direction,
        "inputs": list(run.inputs),
        "velocity_left": plain(run.velocity_left),
        "displacement_left": plain(run.displacement_left),
        "outputs": output_records(model, run.outputs),
        "peaks": plain(run.peaks * scale),
        "peak_times_s": plain(run.peak_times),
        "peaks_with_uncertainty": plain(run.uncertain * scale),
        "spectra": {
            "kind": run.spectra_kind,
            "frequencies_hz": plain(run.spectra_frequencies),
            "values": {
                name: {f"Q {Q:g}": plain(v / model.gravity) for Q, v in by_q.items()}
                for name, by_q in run.spectra.items()
            },
            "unit": {"acceleration": "g", "displacement": "g s²", "pseudo-velocity": "g s"}[run.spectra_kind],
        },
        "synthesis": None
        if run.synthesis is None
        else {
            "frequencies_hz": plain(run.synthesis.frequencies),
            "target": plain(run.synthesis.target),
            "reached": plain(run.synthesis.reached),
            "largest_deviation_db": float(np.abs(run.synthesis.decibels).max()),
        },
    }


def notched_record(model: ShakenModel, kind: str, run: NotchedRun) -> dict[str, Any]:
    """Return a notched input; limits and outputs as they are compared, in units of the model."""
    power = 1 if kind == "sine" else 2
    return {
        "frequencies_hz": plain(run.frequencies),
        "level": plain(run.level / model.gravity**power),
        "notched": plain(run.notched / model.gravity**power),
        "input_rms": None if run.input_rms is None else run.input_rms / model.gravity,
        "notches": [
            {
                "from_hz": n.first,
                "to_hz": n.last,
                "deepest_hz": n.deepest,
                "depth_db": n.depth,
                "reason": n.reason,
                "output": n.output,
                "limit": n.limit,
                "without_notch": n.unnotched,
            }
            for n in run.notches
        ],
    }


def run_title(kind: str, test: str) -> str:
    """Return kind and name of a test; tests of the command line are named after their kind."""
    return kind if test == kind.lower() else f"{kind} {test}"


def table_rows(result: ShakeResult) -> list[tuple[Any, ...]]:
    """Return one row for each output and run, with the columns `COLUMNS`; rounding errors are omitted."""
    model, rows = result.model, []
    for sine in result.sine:
        scale, keep = factors(model, sine.outputs), reported_rows(sine.outputs, sine.peaks)
        swept, notched = sine.swept_peaks, result.notched.get(("sine", sine.test, sine.direction))
        static = sine.static.max(axis=0)
        for k in keep:
            o, s = sine.outputs[k], scale[k]
            rows.append(
                (
                    sine.test,
                    "sine",
                    sine.direction,
                    o.name,
                    o.place,
                    in_tables(model, o)[1],
                    s * sine.peaks[k],
                    "amplitude",
                    f"{sine.peak_frequencies[k]:.6g} Hz",
                    s * sine.uncertain[:, k].max(),
                    None,
                    s * static[k],
                    None if swept is None else s * swept[k],
                    None if notched is None else s * notched.sizes[:, k].max(),
                )
            )
    for random in result.random:
        scale, keep = factors(model, random.outputs), reported_rows(random.outputs, random.rms)
        notched = result.notched.get(("random", random.test, random.direction))
        for k in keep:
            o, s = random.outputs[k], scale[k]
            rms = None if notched is None or notched.rms is None else s * notched.rms[k]
            rows.append(
                (
                    random.test,
                    "random",
                    random.direction,
                    o.name,
                    o.place,
                    in_tables(model, o)[1],
                    s * random.rms[k],
                    "rms",
                    f"{random.crossings[k]:.6g} crossings/s",
                    s * random.uncertain[k],
                    3 * s * random.rms[k],
                    None,
                    None,
                    rms,
                )
            )
    for run in result.time:
        scale, keep = factors(model, run.outputs), reported_rows(run.outputs, run.peaks)
        for k in keep:
            o, s = run.outputs[k], scale[k]
            rows.append(
                (
                    run.test,
                    run.kind,
                    run.direction,
                    o.name,
                    o.place,
                    in_tables(model, o)[1],
                    s * run.peaks[k],
                    "largest",
                    f"{run.peak_times[k]:.6g} s",
                    s * run.uncertain[k],
                    None,
                    None,
                    None,
                    None,
                )
            )
    return [tuple(float(v) if isinstance(v, np.floating) else v for v in row) for row in rows]


def reported_rows(outputs: tuple[Output, ...], values: Array) -> list[int]:
    """Return the outputs that are not rounding errors compared with others of their kind."""
    largest: dict[str, float] = {}
    for output, value in zip(outputs, values, strict=True):
        largest[output.kind] = max(largest.get(output.kind, 0.0), float(value))
    return [k for k, (o, v) in enumerate(zip(outputs, values, strict=True)) if v > ROUNDING * largest[o.kind]]


def shake_table(result: ShakeResult) -> Table:
    """Return the table of all outputs and runs."""
    return Table.of_rows(COLUMNS, table_rows(result))


# compact records ------------------------------------------------------------------------------------------------------


def light_record(record: dict[str, Any], file_name: str) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the record without its curves, and the curves by their paths; unchanged if there are few numbers.

    Curves are lists of more than 50 numbers, or lists of such lists. In the record they are replaced by a reference
    such as {"array": "random/0/densities", "shape": [12, 804]}, and "curves" names the file that contains them.

    Parameters
    ----------
    record
        The record, from `shake_record`.
    file_name
        Name of the file of arrays (.npz).
    """
    if sum(size_of_curves(value) for value in record.values()) <= MOST_NUMBERS:
        return record, {}
    arrays: dict[str, Array] = {}
    light = {key: without_curves(value, key, arrays) for key, value in record.items()}
    return {**light, "curves": {"file": file_name, "key": "array", "missing": "NaN"}}, arrays


def is_curve(value: Any) -> bool:
    """Return whether a value is a long list of numbers, or of lists."""
    if not isinstance(value, list) or not value:
        return False
    if isinstance(value[0], list):
        return len(value[0]) > FEW and all(is_curve(each) for each in value)
    return len(value) > FEW and all(isinstance(each, float | int | None) for each in value)


def size_of_curves(value: Any) -> int:
    """Return the number of values in the curves of a value."""
    if is_curve(value):
        return int(np.size(value))
    if isinstance(value, dict):
        return sum(size_of_curves(each) for each in value.values())
    return sum(size_of_curves(each) for each in value) if isinstance(value, list) else 0


def without_curves(value: Any, place: str, arrays: dict[str, Array]) -> Any:
    """Return a value with references in place of its curves, which are added to the arrays."""
    if is_curve(value):
        arrays[place] = np.array(value, dtype=float)  # None becomes NaN
        return {"array": place, "shape": list(arrays[place].shape)}
    if isinstance(value, dict):
        return {key: without_curves(each, f"{place}/{key}", arrays) for key, each in value.items()}
    if isinstance(value, list):
        return [without_curves(each, f"{place}/{k}", arrays) for k, each in enumerate(value)]
    return value
