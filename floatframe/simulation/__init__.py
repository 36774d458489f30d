"""The time loop: steps, events, restart, and the watch over the range of linear frames."""
