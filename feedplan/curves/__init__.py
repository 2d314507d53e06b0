"""Curves of any degree, polynomial and rational, and their lengths: what programs and paths are made of."""
