"""Trajectories of other programs: files, columns, conventions, units."""
