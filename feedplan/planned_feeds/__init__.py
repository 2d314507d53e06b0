"""Writes a program with planned feeds: its text with the F of each block set to the plan's speed.

A controller uses F as an upper limit, and accelerates and decelerates between blocks by itself. So the F of a
block is the greatest planned speed in it, rounded down to five digits; where the plan reaches the program's
own F, that F stays. A program whose feeds are all reached is returned byte for byte. With a `feed_step` lines
and arcs are split where the planned speed varies by more than this, so that the F of each part is close to
the planned speed; without `feed_step` the geometry does not change by a single bit. The text is read back and
compared before it is returned.

Lines that run more than once (in loops and subroutines), threads, and lines with a computed F are not
changed; the program's own F is restored before them. G0 stays G0.
"""
