"""The classical motions in closed form, a class in a file."""
