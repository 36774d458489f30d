"""Steps of the structure-preserving schemes in readable Python with exact derivatives, the oracle of compiled steps."""
