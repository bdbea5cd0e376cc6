"""Validated enclosures: any motion by Taylor series with a proven remainder, and its derivatives."""
