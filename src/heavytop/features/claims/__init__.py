"""What is said: published formulas, as printed, and what becomes of them."""
