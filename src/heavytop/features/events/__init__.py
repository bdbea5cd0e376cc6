"""Times at which a function of the state changes sign, of computed and of known motions."""
