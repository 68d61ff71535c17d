"""``python -m detp.core.compiled``: compile the kernels now, and say where they are kept."""

import sys

from . import compile_now

try:
    print(compile_now())
except ImportError as error:
    sys.exit(f"The kernels need Numba: pip install numba ({error}).")
except OSError as error:
    sys.exit(f"The kernels cannot be stored: {error}.")
