"""Machines: axes with their limits, the servo period, and the kinematics between axes and tool."""
