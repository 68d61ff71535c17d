"""One bake over many workers, by dask.distributed, which alone this room imports, and only when it is asked for."""
