"""Resistance of TCAs and what a circuit measures of it."""
