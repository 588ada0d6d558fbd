"""Least energy of soft bodies in series over all motions of their sections."""
