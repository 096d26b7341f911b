"""Writes the pickles that the tests read, as the paper's authors stored their labels (run once, with NumPy 2)."""
import pickle
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
shared = np.array([11.5, 12.5])
labels = {
    0: {0: (np.array([657.0, 383.0]), True), 3: (np.array([654.449, 382.878]), False)},
    1: {0: (np.array([10, 20]), True), 1: (np.array([11, 21], dtype=np.int32), False)},
    2: {1: (np.array([1.5, -2.25], dtype=np.float32), np.bool_(True)), np.int64(2): (shared, False)},
    3: {2: (shared, True), 3: (np.array([3.0, 4.0], dtype=">f8"), False)},
}
for protocol in range(6):
    data = pickle.dumps(labels, protocol=protocol)
    (HERE / f"labels_p{protocol}.pkl").write_bytes(data)
    # NumPy 1 named the module without the underscore.
    if protocol == 0:
        old = data.replace(b"numpy._core", b"numpy.core")
        (HERE / "labels_numpy1_p0.pkl").write_bytes(old)
sys.stdout.write("done\n")
