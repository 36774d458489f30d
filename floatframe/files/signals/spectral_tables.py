"""Spectra as tables (CSV) and records (JSON) for other programs."""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import SignalError
from floatframe.files.signals.orders import SpectralMap
from floatframe.files.signals.spectra import Spectrum
from floatframe.files.signals.transfer import TransferEstimate

__all__ = ["spectral_csv", "spectral_record"]

AnySpectrum = Spectrum | SpectralMap | TransferEstimate


def spectral_csv(spectra: Sequence[AnySpectrum]) -> str:
    """Return spectra as comma-separated values: over common frequencies side by side, maps one below the other."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    first = spectra[0]
    if isinstance(first, SpectralMap):
        line = "order" if first.kind == "order" else "frequency [Hz]"
        writer.writerow(
            ["name", "time [s]", "speed [rad/s]", line, f"amplitude ({'rms' if first.is_rms else 'peak'})", "unit"]
        )
        for each in spectra:
            assert isinstance(each, SpectralMap)  # of one kind with the first
            speeds: Iterable[Any] = [""] * len(each.times) if each.speeds is None else each.speeds.tolist()
            for t, speed, row in zip(each.times.tolist(), speeds, each.amplitudes.tolist(), strict=True):
                writer.writerows(
                    [each.name, repr(t), repr(speed) if speed != "" else "", repr(x), repr(a), each.unit]
                    for x, a in zip(each.lines.tolist(), row, strict=True)
                )
        return text.getvalue()
    columns: dict[str, Array] = {"frequency [Hz]": first.frequencies}
    if isinstance(first, Spectrum) and first.edges is not None:
        columns |= {"from [Hz]": first.edges[:, 0], "to [Hz]": first.edges[:, 1]}
    for each in spectra:
        if isinstance(each, TransferEstimate):
            name = f"{each.output} / {each.input}"
            columns |= {
                f"{name} H1 [{each.unit}]": np.abs(each.H1), f"{name} H1 phase [degrees]": np.angle(each.H1, deg=True),
                f"{name} H2 [{each.unit}]": np.abs(each.H2), f"{name} H2 phase [degrees]": np.angle(each.H2, deg=True),
                f"{name} coherence": each.coherence,
            }  # fmt: skip
        elif isinstance(each, Spectrum):
            columns[f"{each.name} {each.kind} [{each.unit}]"] = each.values
    if len({len(values) for values in columns.values()}) != 1:
        raise SignalError("spectra over different frequencies do not stand in one table; write them one by one")
    writer.writerow(columns)
    writer.writerows([repr(float(x)) for x in row] for row in zip(*columns.values(), strict=True))
    return text.getvalue()


def spectral_record(spectra: Sequence[AnySpectrum]) -> list[dict[str, Any]]:
    """Return spectra in plain types: every field by its name, complex numbers in two parts, NaN as None."""
    return [{key: plain(value) for key, value in vars(each).items()} for each in spectra]


def plain(value: Any) -> Any:
    """Return lists in place of arrays."""
    if isinstance(value, np.ndarray):
        if np.iscomplexobj(value):
            return {"real": plain(value.real), "imaginary": plain(value.imag)}
        whole = value.astype(object)
        whole[~np.isfinite(value)] = None
        return whole.tolist()
    return list(value) if isinstance(value, tuple) else value
