"""Factorisation and eigensolvers of large sparse symmetric pencils."""
