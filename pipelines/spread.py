"""How the median absolute deviation, which few wrong values cannot change, becomes a standard deviation."""

NORMAL_MAD = 1.4826  # standard deviations to a median absolute deviation, if values scatter as a gaussian has it
