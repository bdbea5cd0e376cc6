"""Error of single steps."""
