"""Inputs that mean harm, made from a seed and given to the whole program: `python -m tests.hostile --help`."""
