"""Commands that bring models in from other programs, and bodies out to them."""
