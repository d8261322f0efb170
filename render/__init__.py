"""How one image is made: target, light, exact fish-eye sensor, linear-light master, developed 8-bit frame."""
