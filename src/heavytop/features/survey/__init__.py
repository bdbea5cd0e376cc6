"""Surveys: many motions in arrays, from the draw to the disk."""
