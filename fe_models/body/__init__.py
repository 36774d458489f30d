"""The finite element model of one body (`FEBody`), its interfaces, couplings and loads."""
