"""The program with planned feeds: its text, in which no block asks for more than the plan's speed.

A controller takes F as an upper bound and makes its own way up and down between blocks. So F of a block is
the greatest speed that the plan has in it, rounded down to five digits, and the program's own F where the
plan reaches that: a program whose feeds are all reached comes back byte for byte. With a `feed_step` lines
and arcs are split where the planned speed varies by more, so that the F of each part is near the plan
everywhere; without one the geometry is the same bit for bit. What was written is read back and compared
before it is handed out.

Lines that run more than once, as those of loops and subroutines, stay as they are, and so do threads and
lines whose F is computed; the program's own F comes back before them. G0 stays G0.
"""

from feedplan.planned_feeds.rewrite import PlannedProgram, planned_program, write_program

__all__ = ["PlannedProgram", "planned_program", "write_program"]
