"""The program with planned feeds: its text, in which no block asks for more than the plan's speed.

A controller takes F as an upper limit, and speeds up and slows down between blocks by itself. So the F of a
block is the greatest planned speed in it, rounded down to five digits; it stays the program's own F where the
plan reaches that. A program whose feeds are all reached is returned byte for byte. With a `feed_step` lines
and arcs are split where the planned speed varies by more, so that the F of each part is near the plan;
without one the geometry is the same bit for bit. The text is read back and compared before it is returned.

Lines that run more than once, in loops and subroutines, stay as they are, and so do threads and lines whose F
is computed; the program's own F is restored before them. G0 stays G0.
"""
