"""`cms view`: pictures and films of modes on the real surface."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.arguments import ModalFile
from cms.cli.console import guarded, output_path, say, stages

__all__ = ["view_command"]


@guarded
def view_command(
    file: ModalFile,
    mode: Annotated[int, typer.Option("--mode", "-m", help="Number of the mode, as cms info lists them.")] = 1,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture to write (.png).")] = None,
    animate: Annotated[Path | None, typer.Option("--animate", "-a", help="Film to write (.gif or .mp4).")] = None,
    scale: Annotated[
        float | None, typer.Option(help="Largest displacement drawn, as a share of the body's diagonal; default 0.09.")
    ] = None,
) -> None:
    """Draw a mode on the real surface of the body, as a picture or a film; works without a display.

    Without -o and --animate, the picture is written beside the modal file: rod.h5 gives rod_mode3.png.

    Example: cms view rod.h5 --mode 3 -o m3.png

    Example: cms view rod.h5 --mode 3 --animate m3.gif
    """
    from cms.assessment.rendering import SceneError
    from cms.assessment.report.view import animate_mode, view_mode
    from cms.body.modal_file.file import read

    picture = output
    if output is None and animate is None:
        picture = file.with_name(f"{file.stem}_mode{mode}.png")
    wanted = [path for path in (picture, animate) if path]
    targets = [output_path(path, "", SceneError, overwrite_of=(file,), needs_file=True) for path in wanted]
    body = read(file)
    with stages() as clock:
        if picture is not None:
            with clock("draw"):
                view_mode(body, mode, picture, scale=scale)
        if animate is not None:
            with clock("film") as advance:
                animate_mode(body, mode, animate, scale=scale, on_frame=lambda done, all_: advance(done / all_))
    for path in targets:
        say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
