"""Calibration targets: which points they have, where their brightness jumps, and how they reflect light."""
