"""Mistakes in a trajectory that another program computed: hypotheses, each tried."""
