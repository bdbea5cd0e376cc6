"""From a claim, of the paper or in a file, to a verdict for every equation."""
