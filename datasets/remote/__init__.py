"""Datasets in an object store: whole files are put and fetched, each visible when it is whole."""
