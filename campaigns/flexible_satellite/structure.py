"""Mass and modes of the flexible satellite, and whether a craft can have them.  NumPy, SI, whole chunks.

Numbers in brackets are equations of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering 24(3),
2022; the data are its Tables 10 and 11.
"""

import numpy as np

from mc_engine.model import Refusals

# c0, kg^(1/2) m: rows body x, y, z; columns modes 1 to 4.  Printed with a transpose sign and in kg m^2, which cannot
# be: (1) and (2) need 3 x 4 and a square root of an inertia.
COUPLING = np.array(
    [
        [7.0, -1.2, 1.1, 1.2],
        [1.2, 0.9, 2.5, -2.6],
        [2.2, -1.7, -0.8, -1.1],
    ]
)


def inertia_matrix(xx, yy, zz, xy, xz, yz) -> np.ndarray:
    """Symmetric matrices float64[n, 3, 3] of these entries; the off-diagonal ones are minus the products of inertia."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)


def rigid_part(inertia: np.ndarray, coupling: np.ndarray) -> np.ndarray:
    """J - c0 c0^T, float64[n, 3, 3]: the inertia that is left to the body when the modes give way.

    inertia : float64[n, 3, 3];  coupling : float64[n, 3, 4]
    """
    return inertia - coupling @ coupling.transpose(0, 2, 1)


def refuse_unphysical(inertia: np.ndarray, coupling: np.ndarray, refusals: Refusals) -> np.ndarray:
    """Inverse of J - c0 c0^T, float64[n, 3, 3]; cases that no body can be join `refusals` and have the unit matrix."""
    finite = np.isfinite(inertia).all(axis=(1, 2)) & np.isfinite(coupling).all(axis=(1, 2))
    refusals.add(~finite, "the inertia matrix is not finite")
    unit = np.eye(3)
    usable = finite[:, None, None]
    inertia = np.where(usable, inertia, unit)
    low, middle, high = np.linalg.eigvalsh(inertia).T
    refusals.add(~(low > 0.0), "the inertia matrix is not positive definite")
    refusals.add(
        high > (low + middle) * (1.0 + 1e-12),
        "the principal moments of inertia break the triangle inequality: the largest is above the sum of the others",
    )
    rigid = np.where(usable, rigid_part(inertia, coupling), unit)
    positive = np.linalg.eigvalsh(rigid)[:, 0] > 0.0
    refusals.add(
        ~positive, "J - c0 c0^T is not positive definite: the modes carry more inertia than the whole satellite has"
    )
    return np.linalg.inv(np.where(positive[:, None, None], rigid, unit))
