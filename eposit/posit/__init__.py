"""POSIT's iteration: scaled orthography as a function of three unknowns, its fixed points, and Newton steps to them."""
