"""``detp study``: the experiments of the 2006 study, on scene files too."""
