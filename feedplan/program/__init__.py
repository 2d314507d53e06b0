"""Part programs: reads text, and makes moves in millimetres and seconds."""
