"""Runs along homoclinic motions, and the law of their escape times."""
