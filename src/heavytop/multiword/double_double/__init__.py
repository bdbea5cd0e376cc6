"""Taylor steps in double-double arithmetic: one motion, or eight side by side in SIMD lanes."""
