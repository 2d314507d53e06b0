"""Machines: axes with their limits, the servo period, and how axes carry the tool."""
