"""From the segments that cross a disc to irradiance and its error."""
