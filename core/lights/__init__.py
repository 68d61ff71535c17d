"""Light sources: one module per kind, all behind the protocol in :mod:`.light`."""
