"""Moving bodies: the top, its equations, its first integrals, its angles.  Independent of number formats."""
