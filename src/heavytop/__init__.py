"""heavytop measures how wrong computed and claimed motions of a heavy top are, against references that are proven."""
