"""Inputs that once failed, tried again: `python -m tests.cases FOLDER [PAGE]`.

The folder holds the inputs and their right values; they are not part of this repository, some being crops of public
photographs.
"""
