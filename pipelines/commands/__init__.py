"""The commands: each parses, calls one function and prints; heavy modules are imported inside them."""
