"""The command line `cms`: reduce, inspect and draw flexible bodies."""

__all__ = ["main"]


def main() -> None:
    """Run the command line (entry point of the package)."""
    from cms.cli.app import app
    from cms.cli.console import run

    run(app, "cms")
