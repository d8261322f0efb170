"""Kinds of hostile inputs; each module has `make(rng, place)`, the name of one case and the calls that it takes."""
