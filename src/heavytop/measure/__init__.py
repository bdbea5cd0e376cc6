"""How wrong it is."""
