"""What NVIDIA's assembler says of the kernels of shipped campaigns, without a card: a table for the documentation.

    python -m tests.benchmarks.card_code                 # the main campaigns
    python -m tests.benchmarks.card_code reentry/autopilot

Bytes are of one thread: a card keeps what finds no register in memory of its own.  It needs ptxas, of the package
nvidia-cuda-nvcc-cu12.  `card_speed` measures times on a card.
"""

import re
import sys

from mc_engine.flight.card_code import CAPABILITIES, ptx_of, thread_code
from tests.mc_engine.flight.cards.assembler import assembled, ptxas
from tests.mc_engine.flight.cards.shipped_kernels import kernel_call

USUAL = ("minimal", "deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry")


def lines(names):
    """The rows of the table, one for each campaign and kind of card."""
    yield "| campaign | card | fma | registers | stack [B] | spill stores [B] | spill loads [B] |"
    yield "|---|---|---|---|---|---|---|"
    for name in names:
        call = kernel_call(name, 1)
        code = thread_code(call.func, call.args)
        for capability in CAPABILITIES:
            ptx = ptx_of(code, capability)
            fused = len(re.findall(r"\bfma\.rn\.f64", ptx))
            numbers = (fused, *assembled(ptx, capability))
            yield f"| {name} | sm_{capability} | {' | '.join(f'{number:,}' for number in numbers)} |"


if __name__ == "__main__":
    if ptxas() is None:
        sys.exit("ptxas is not installed: pip install nvidia-cuda-nvcc-cu12")
    for line in lines(sys.argv[1:] or USUAL):
        print(line, flush=True)
