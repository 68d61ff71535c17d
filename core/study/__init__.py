"""The study of 2006 done again with this code: its experiments, its theory, and the choice that follows from them."""
