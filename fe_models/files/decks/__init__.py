"""Whole decks of finite element programs: one record whatever the program, with a ledger of what was not taken over."""
