"""One module for each program whose reduced bodies are read or written."""
