"""Jobs written from whole decks of finite element programs."""
