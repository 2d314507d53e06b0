"""Benchmarks of feedplan: named problems, one runner (`python -m benchmarks`), see README.md."""
