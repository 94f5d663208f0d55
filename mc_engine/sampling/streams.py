"""Random numbers by address: every draw is a function of (seed, name, case) alone.

Another dispersion, case or worker does not change any other number.  A change of any function here is a new seed
contract: raise SEED_CONTRACT and say so in the change log.
"""

import hashlib
from collections.abc import Sequence

import numpy as np

from mc_engine.sampling.first_numbers import first_numbers

SEED_CONTRACT = 1


def stream_key(seed: int, name: str) -> np.ndarray:
    """The Philox key of one named stream, uint64[2]."""
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    return np.frombuffer(digest[:16], dtype="<u8").astype(np.uint64)


def stream(seed: int, name: str, case_id: int) -> np.random.Generator:
    """NumPy generator for one named quantity of one case, independent of all other draws."""
    # The case is the top word: 2**192 blocks per case before two cases could meet.
    return np.random.Generator(np.random.Philox(key=stream_key(seed, name), counter=[0, 0, 0, case_id]))


def uniforms(seed: int, name: str, case_ids: np.ndarray) -> np.ndarray:
    """float64[n] in [0, 1): for each case the first `random()` of its `stream`, bit for bit.

    case_ids : int64[n], not negative.
    """
    return uniform_columns(seed, [name], case_ids)[0]


def uniform_columns(seed: int, names: Sequence[str], case_ids: np.ndarray) -> np.ndarray:
    """float64[n_names, n]: the `uniforms` of several names, drawn together, since a chunk has few cases of each."""
    keys = np.array([stream_key(seed, name) for name in names], dtype=np.uint64).reshape(-1, 2)
    return first_numbers(keys, np.asarray(case_ids).astype(np.uint64))
