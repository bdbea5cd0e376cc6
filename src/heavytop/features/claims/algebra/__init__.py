"""The field of a claim's formulas: reading, rational functions, generators, signs, conditions, the prover."""

from heavytop.extras import require_extra

require_extra("claims")
