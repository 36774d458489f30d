"""Files of ANSYS: whole decks (.cdb), and matrices and superelements (.full, .sub)."""
