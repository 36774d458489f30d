"""Complete decks of finite element programs: one record for all programs, with a ledger of unconverted data."""
