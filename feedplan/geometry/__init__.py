"""Geometry: a program's moves as a path of polynomial pieces, exact and never tessellated."""
