"""Mass and stiffness matrices from files of any program: a table of readers, and a record that all of them fill."""
