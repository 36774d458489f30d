"""Commands that import models from other programs, and export bodies to them."""
