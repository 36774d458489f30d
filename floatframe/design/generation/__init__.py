"""Generated code for one system: its recursive equations as simplified expressions, written in other languages."""
