"""Known motions: motions as balls with a radius, at any time and to any number of bits."""
