"""One BLAS thread, before numpy is imported: two test processes share two cores, and sums keep their order."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
