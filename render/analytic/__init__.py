"""The closed-form renderer: every pixel from areas of straight edges and a smooth map of the light, in Dr.Jit."""
