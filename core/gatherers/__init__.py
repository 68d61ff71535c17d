"""Gatherers: three searches for the segments that cross each disc, behind one interface."""
