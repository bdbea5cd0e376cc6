"""Taylor steps on fixed grids of K words, with sums of products that are exact in digits of 24 bits."""
