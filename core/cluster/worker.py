"""What a process of processes.py runs: a script of its own, which reads from its input where the rest of the core is.

It ends when the one that started it does.
"""

import importlib.util
import json
import os
import queue
import socket
import sys
import threading
from importlib import import_module
from pathlib import Path

#: The name of the core in this process.
CORE = "detp_core"


def main() -> None:
    """Do what comes over the socket until it is closed."""
    told = json.load(sys.stdin)
    sys.path[:] = told["path"]
    folder = Path(__file__).parents[1]
    spec = importlib.util.spec_from_file_location(
        CORE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    sys.modules[CORE] = core = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(core)
    bench, packing = (import_module(f"{CORE}.cluster.{name}") for name in ("bench", "packing"))
    import_module(f"{CORE}.memory").keep_memory()
    with socket.create_connection(("127.0.0.1", told["port"])) as to:
        to.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        to.sendall(bytes.fromhex(told["token"]))
        coming = queue.SimpleQueue()
        threading.Thread(target=_listen, args=(packing.received, to, coming), daemon=True).start()
        held = {}
        while True:
            what, *rest = coming.get()
            if what == "give":
                held[rest[0]] = rest[1]
            elif what == "drop":
                del held[rest[0]]
            else:
                task, keys, piece = rest
                packing.send(to, (bench.done(task, keys, piece, *(held[key] for key in keys)),))


def _listen(received, at: socket.socket, coming: queue.SimpleQueue) -> None:
    """Take what comes while the last piece is worked on, so that neither side waits to send; end with the sender."""
    try:
        while True:
            coming.put(received(at))
    finally:
        os._exit(0)


if __name__ == "__main__":
    main()
