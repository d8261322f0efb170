"""Solvers by name: ours, other people's through adapters, and a user's own function."""
