"""The command line `floatframe`, which computes, analyses, plots and animates motions."""

__all__ = ["main"]


def main() -> None:
    """Run the command line (entry point of the package)."""
    from cms.cli.console import run
    from floatframe.cli.app import app

    run(app, "floatframe")
