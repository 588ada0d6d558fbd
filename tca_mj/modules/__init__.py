"""Soft modules, one file each: a spec and the builder of its part."""
