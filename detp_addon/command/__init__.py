"""The command line: its options, many files, each in a process of its own, signals, and lines on a terminal."""
