"""Processor time of a call in this thread, so that neither other threads nor other programs count."""

import gc
import math
import time


def seconds(call, enough):
    """The least of three times [s], or the first below `enough`: other work on the machine makes a time long."""
    least = math.inf
    gc.freeze()  # what other tests have left in this process is not searched for waste on the clock
    try:
        for _ in range(3):
            begin = time.thread_time()
            call()
            least = min(least, time.thread_time() - begin)
            if least < enough:
                break
    finally:
        gc.unfreeze()
    return least
