"""The script in the resources of an FMU that its binary loads: a class that hands every call on to a `HostedUnit`.

The binaries are those of PythonFMU (FMI 2.0) and PythonFMU3 (FMI 3.0). They find the class by its line in the script,
call its methods, and know states as the Python objects that it gives them.
"""

__all__ = ["slave_script"]

SCRIPT = '''"""The unit of a floatframe system; written by floatframe, read by the binary of this FMU."""

import atexit
import ctypes
import functools
import os
import sys
from pathlib import Path

try:
    from floatframe.files.cosimulation.archive import HostedUnit, words_of
    from floatframe.errors import ConvergenceError
except ImportError as error:  # told by the instance: the binary does not survive an error of the script itself
    missing = (
        f"this FMU needs floatframe in the Python that hosts it ({{sys.executable}}, {{sys.version.split()[0]}}), "
        f"where it does not load: {{error}}; install it there: pip install floatframe"
    )
else:
    missing = ""

from {package}.{module} import {base}
from {package}.enums import {status}
{imports}
RELEASES = {{}}  # a function of each binary in this process, by the path of the binary


def release_python_at_exit(resources):
    """Let the binary release Python while Python still runs.

    The Linux binary releases it at the end of the process too, but from a static pointer that is destroyed by then: it
    writes into freed memory, which ends the process with "corrupted double-linked list" or not at all, by chance.
    """
    if sys.platform != "linux":
        return
    for path in Path(resources).parent.glob("binaries/*linux*/*.so"):
        if path not in RELEASES:
            try:
                binary = ctypes.CDLL(str(path), mode=os.RTLD_LAZY | os.RTLD_NOLOAD)
                RELEASES[path] = binary.finalizePythonInterpreter
            except (AttributeError, OSError):  # loaded from elsewhere, or another release of the binary
                continue
            atexit.register(RELEASES[path])


def told(method):
    """Let an error reach the log of the master as its words, and the binary survive it.

    The binary lets go of class, instance and messages when an error is raised, and once more when it frees the
    instance: without one more reference to each it would free them twice.
    """

    @functools.wraps(method)
    def call(self, *args):
        try:
            return method(self, *args)
        except Exception as error:
            for each in (type(self), self, self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(each))
            raise RuntimeError(words_of(error)) from None

    return call


class FloatframeSlave({base}):
    """Hands on every call."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        if missing:
            print(missing, file=sys.stderr)
            raise ImportError(missing)
        release_python_at_exit(self.resources)
        self.unit = HostedUnit(self.resources, lambda words: self.log(words, {status}.warning))

    @told
    def setup_experiment(self, start_time, *_):
        self.unit.t_start = start_time

    @told
    def exit_initialization_mode(self):
        self.unit.begin()

    @told
    def do_step(self, current_time, step_size):
        try:
            self.unit.step(current_time, step_size)
        except ConvergenceError as error:  # the unit is where it was: the master may try a smaller step
            self.log(words_of(error), {status}.error)
            return {failed}
        return {done}

    @told
    def get_{real}(self, vrs):
        return self.unit.get(vrs)

    @told
    def set_{real}(self, vrs, values):
        self.unit.set(vrs, values)

    @told
    def _get_fmu_state(self):
        return HeldState(self.unit, self.unit.state())

    @told
    def _set_fmu_state(self, state):
        self.unit.restore(state.of(self.unit))

    @staticmethod
    def _fmu_state_to_bytes(state):
        return state.content()

    @staticmethod
    def _fmu_state_from_bytes(content):
        return HeldState(None, content)


class HeldState:
    """A state, or the bytes of one that is yet to be read."""

    def __init__(self, unit, state):
        self.state = state

    def of(self, unit):
        return unit.state_of_bytes(self.state) if isinstance(self.state, bytes) else self.state

    def content(self):
        return self.state if isinstance(self.state, bytes) else self.state.to_bytes()
'''

WORDS = {
    2: {
        "package": "pythonfmu", "module": "fmi2slave", "base": "Fmi2Slave", "status": "Fmi2Status", "real": "real",
        "imports": "", "failed": "False", "done": "True",
    },
    3: {
        "package": "pythonfmu3", "module": "fmi3slave", "base": "Fmi3Slave", "status": "Fmi3Status",
        "real": "float64", "imports": "from pythonfmu3.fmi3slave import Fmi3StepResult\n",
        "failed": "Fmi3StepResult(status=Fmi3Status.discard)", "done": "Fmi3StepResult(status=Fmi3Status.ok)",
    },
}  # fmt: skip


def slave_script(fmi: int) -> str:
    """Return the script for FMI 2 or 3."""
    return SCRIPT.format(**WORDS[fmi])
