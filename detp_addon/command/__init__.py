"""The command line: its options, many files one after the other, signals, and lines on a terminal."""
