"""Mitsuba's own integrators through our lenses: the oracle that the closed-form renderer is held against."""
