"""The search for the motion that breaks an integrator: drawing, measuring, searching, shrinking, proving."""
