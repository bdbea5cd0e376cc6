"""Work-precision curves."""
