"""shifted_error.py EST.tum GT.tum: the error of a trajectory whose stamps are later than the truth's by an unknown time, as JSON. That time is
the one that leaves the least error; the world is aligned by rotation and translation, for a live one is
not level yet when it begins."""
import json
import sys

import numpy as np


def aligned(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    a, b = a - a.mean(0), b - b.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    return a @ (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt) - b


def error_at(shift: float, est: np.ndarray, gt: np.ndarray) -> float:
    t = est[:, 0] - shift
    inside = (t > gt[0, 0]) & (t < gt[-1, 0])
    if inside.mean() < 0.8:
        return np.inf
    truth = np.stack([np.interp(t[inside], gt[:, 0], gt[:, k]) for k in (1, 2, 3)], 1)
    return float(np.sqrt((aligned(est[inside, 1:4], truth) ** 2).sum(1).mean()))


def main() -> int:
    est, gt = (np.loadtxt(path) for path in sys.argv[1:3])
    est = est[:: max(1, len(est) // 2000)]
    best = est[0, 0] - gt[0, 0]
    for step in (0.05, 0.005, 0.0005, 0.0001):
        best = min((best + step * k for k in range(-40, 41)), key=lambda shift: error_at(shift, est, gt))
    print(json.dumps({"rmse": error_at(best, est, gt), "poses": len(est)}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
