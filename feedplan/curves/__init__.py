"""Curves of any degree, polynomial and rational, and their lengths: the parts of programs and paths."""
