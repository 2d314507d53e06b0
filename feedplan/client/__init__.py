"""A feedplan service from Python, with the calls of the package itself."""
