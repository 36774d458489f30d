"""The reduction job: its file, the body it describes, and all steps from the file to a reduced body."""
