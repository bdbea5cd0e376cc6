"""The field of a claim's formulas: reading, rational functions, generators, signs, conditions, the prover."""
