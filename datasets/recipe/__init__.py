"""Recipes: what decides a dataset's content, read from TOML, validated and described."""
