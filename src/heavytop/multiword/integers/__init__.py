"""Taylor coefficients in integers of any length, for precisions beyond those of words."""
