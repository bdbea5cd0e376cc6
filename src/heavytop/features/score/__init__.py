"""Motions computed elsewhere: reading their files, scoring them, explaining their errors."""
