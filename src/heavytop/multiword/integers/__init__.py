"""Taylor coefficients in integers of any length, beyond what the words of a double hold."""
