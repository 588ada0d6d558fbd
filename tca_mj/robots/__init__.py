"""Robots, one file each: modules attached to modules."""
