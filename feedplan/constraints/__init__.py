"""Limits: builds the planning problem, which every planner takes, from a path and a machine."""
