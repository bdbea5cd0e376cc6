"""What is computed: integrators behind one call."""
