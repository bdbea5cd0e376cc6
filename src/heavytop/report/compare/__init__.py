"""Two reports, row by row and metric by metric."""
