"""Arithmetic in many words: machine code for the Taylor recurrence of both systems, in eight lanes."""
