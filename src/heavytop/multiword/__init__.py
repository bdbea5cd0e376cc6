"""Multi-word arithmetic: machine code for the Taylor recurrence of both systems, in eight lanes."""
