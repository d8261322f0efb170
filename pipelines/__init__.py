"""Stages, engines, reports and the command line."""
