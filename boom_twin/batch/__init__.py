"""Many sessions through the twin: each in a process of its own, here or as tasks of Dask; one table of the results."""
