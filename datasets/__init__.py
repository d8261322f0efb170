"""Recipes, plans, tables and the store: what is to be made, and how it lies on disk."""
