"""Planners: a problem in, a speed profile out; one file a method, found by its name."""
