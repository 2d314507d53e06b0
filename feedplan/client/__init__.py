"""Uses a feedplan service from Python, with the same calls as the package itself."""
