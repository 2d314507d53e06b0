"""Geometry: the path of a program as exact polynomial pieces, never as short lines."""
