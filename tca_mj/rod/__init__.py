"""Elastic beams and rods: rotations, static shapes, and the loads that a TCA puts on its route."""
