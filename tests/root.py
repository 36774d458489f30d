"""Where the checkout begins, for tests that read its pages and start its commands."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
