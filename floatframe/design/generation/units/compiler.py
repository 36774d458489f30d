"""Sources in C made a shared library by the C compiler of this machine."""

import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from floatframe.errors import ModelError

__all__ = ["compiled_library", "platform_folder"]

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
#: system and machine as Python names them -> folder of binaries in FMI 2.0 (those of its text alone) and FMI 3.0
FOLDERS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): ("aarch64-linux", "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin"),
    ("win32", "AMD64"): ("win64", "x86_64-windows"),
}
SUFFIXES = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}


def platform_folder(fmi: int) -> str:
    """Return the folder that binaries of this machine have in an FMU; `ModelError` where FMI has no name for it."""
    here = (sys.platform, platform.machine())
    if here not in FOLDERS:
        raise ModelError(f"generate: FMI has no name for binaries of this machine ({here[0]}, {here[1]})")
    return FOLDERS[here][0 if fmi == 2 else 1]


def compiled_library(sources: Mapping[str, bytes]) -> tuple[str, bytes]:
    """Return the ending and the content of a shared library of C sources and headers, by name.

    The compiler is that of the environment variable CC, else `cc`.

    Raises
    ------
    ModelError
        If there is no compiler, or it fails.
    """
    command = shlex.split(os.environ.get("CC", "")) or ["cc"]
    program = shutil.which(command[0])
    if program is None:
        raise ModelError(
            f"generate: there is no C compiler {command[0]!r}; install one (Debian, Ubuntu: apt install gcc; macOS: "
            "xcode-select --install; Windows: MinGW-w64), or name yours in the environment variable CC"
        )
    suffix = SUFFIXES[sys.platform]
    with TemporaryDirectory(prefix="floatframe_unit_") as folder:
        for name, text in sources.items():
            Path(folder, name).write_bytes(text)
        files = sorted(name for name in sources if name.endswith(".c"))
        words = [program, *command[1:], *FLAGS, *files, "-lm", "-o", f"unit{suffix}"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, errors="replace")
        if done.returncode:
            lines = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
            raise ModelError(f"generate: {' '.join([*command, *FLAGS])} failed: {' / '.join(lines[:3])}")
        return suffix, Path(folder, f"unit{suffix}").read_bytes()
