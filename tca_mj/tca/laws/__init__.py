"""Tension laws: from the length and temperature of a TCA to its tension and stiffness."""
