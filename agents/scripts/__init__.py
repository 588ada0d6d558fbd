"""Scripted policies of the tasks: feedback on what is seen, no replay."""
