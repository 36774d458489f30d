"""The command `cms accept`: the acceptance document of a reduced body."""

from dataclasses import dataclass
from pathlib import Path

from cms.cli.console import output_path, print_table, say, stages

__all__ = ["AcceptRequest", "run_accept"]


@dataclass(frozen=True)
class AcceptRequest:
    """The arguments of the command."""

    file: Path
    full: Path | None
    deck: Path | None
    program: str | None
    densities: tuple[str, ...]
    band: float | None
    most_dofs: int
    strict: bool
    outputs: tuple[Path, ...]


def run_accept(request: AcceptRequest) -> int:
    """Check the body, write the document, print the verdict; return exit code 1 if the body is not accepted."""
    from cms.assessment.quality.errors import QualityError
    from cms.cli.job import densities_of
    from cms.jobs.acceptance.accept import FullModel, accept_body
    from cms.jobs.acceptance.write import require_suffix, write_acceptance
    from fe_models.foundation.extras import extra_module

    if request.deck is None and (request.program or request.densities):
        option = "--program" if request.program else "--density"
        raise QualityError(f"{option}: says how a deck is read; give the deck with --deck")
    if request.full is not None and request.deck is not None:
        raise QualityError("--full and --deck: expected one full model, got two")
    wanted = request.outputs or (request.file.with_name(f"{request.file.stem}_acceptance.pdf"),)
    inputs = [path for path in (request.file, request.full, request.deck) if path is not None]
    targets = [output_path(path, "", QualityError, overwrite_of=inputs) for path in wanted]
    for target in targets:
        require_suffix(target)
        if target.suffix.lower() == ".pdf":
            extra_module("reportlab", extra="pdf", purpose="write a document as PDF")
    model = FullModel(request.full, request.deck, request.program, densities_of(request.densities))
    with stages() as clock:
        found = accept_body(request.file, model, band=request.band, most_dofs=request.most_dofs, stages=clock)
        with clock("document"):
            write_acceptance(found, *targets)
    todo = [(r.verdict, r.name, r.reason, r.action) for r in found.records if r.verdict in ("fail", "warn")]
    if todo:
        print_table("To be looked at", ("verdict", "check", "found", "what to do"), todo)
    band = found.range.band
    say(f"Good for frequencies up to {band.highest:.5g} Hz: {band.words}")
    say(f"Mesh: {found.mesh_error.words}")
    for target in targets:
        say(f"wrote {target}")
    say(found.words)
    return int(found.verdict == "fail" or (request.strict and found.verdict == "warn"))
