"""The reduction job: the file, the body it describes, and the whole line from it to a reduced body."""
