"""Published claims: the paper's formulas and the entries of the library."""
