"""Part programs: text in, moves in millimetres and seconds out."""
