"""Limits: a path on a machine becomes the one problem that every planner takes."""
