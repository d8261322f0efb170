"""Stress: pictures as cameras spoil them, drawn by brute force, shown to our detection and to OpenCV's two finders.

Nothing that draws or judges is shared with the product: lenses, boards and truth are written from their formulas, so
that a mistake of the product cannot cancel. `python -m tests.stress` runs the kinds of `kinds`, keeps what was found in
`out/stress`, and writes the table and a sheet of the pictures.
"""
