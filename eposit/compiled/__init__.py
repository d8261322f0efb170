"""The solver's compiled functions, for one image at a time: a batch is a loop over them."""
