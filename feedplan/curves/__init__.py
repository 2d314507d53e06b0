"""Curves of any degree, polynomial and rational, and their lengths: used by programs and paths."""
