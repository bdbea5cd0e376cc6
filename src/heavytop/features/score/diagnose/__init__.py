"""What went wrong with a trajectory that another program computed: hypotheses, each tried."""
