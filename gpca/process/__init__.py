"""The process that runs: its processor and threads, compiled code, progress, interrupts, arguments."""
