"""What moves: the top, its equations, its first integrals, its angles.  Pure: no number format is known here."""
