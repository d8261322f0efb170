"""From linear light to 8 bits: optics, motion, noise, digitisation, and named sets of values."""
