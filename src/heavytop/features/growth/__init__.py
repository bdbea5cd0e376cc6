"""How errors grow with the horizon."""
