"""Machine code from LLVM's intermediate representation, and the Taylor recurrence that every arithmetic shares."""
