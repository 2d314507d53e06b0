"""Runs programs and streams in LinuxCNC's simulator, without a display, and records every servo period."""
