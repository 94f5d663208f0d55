"""The first number of many random streams: Philox4x64-10 at counter (1, 0, 0, case), its upper 53 bits in [0, 1).

Salmon, Moraes, Dror & Shaw, Parallel random numbers: as easy as 1, 2, 3, SC'11, section 3.3.  NumPy's generator steps
its counter before the first block, hence the 1 in the lowest word.

The first numbers of a process are computed with NumPy, later ones by machine code that LLVM makes in some milliseconds.
The processor computes the full product of two 64-bit words, which NumPy cannot, so the machine code takes a tenth of
the time; it does not hold the interpreter lock.  Both give the same bits.
"""

import ctypes
from functools import cache
from typing import Any

import numpy as np

_MANY = 2**16  # numbers of a process; for fewer, importing and running LLVM takes longer than what it spares
_BLOCK = 8192  # numbers that NumPy works on at a time: the few arrays of a block stay in the second-level cache
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_MULTIPLIERS = (0xD2E7470EE14C6C93, 0xCA5A826395121157)
_WEYL = (0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B)
_STEPS = [[i * w % 2**64 for w in _WEYL] for i in range(10)]  # from the key to that of each round
_drawn = 0  # by this process, about: threads may count at the same time


def first_numbers(keys: np.ndarray, cases: np.ndarray) -> np.ndarray:
    """float64[n_keys, n]: for each key and case the first number of its stream.

    keys : uint64[n_keys, 2].  cases : uint64[n].
    """
    global _drawn
    numbers = np.empty((len(keys), cases.size))
    _drawn += numbers.size
    if _drawn >= _MANY:
        function, _owner = _machine_code()
        cases = np.ascontiguousarray(cases)
        for key, row in zip(keys.tolist(), numbers, strict=True):
            function(*key, cases.size, cases.ctypes.data, row.ctypes.data)
        return numbers
    size = _BLOCK // max(1, len(keys)) + 1
    for first in range(0, cases.size, size):
        numbers[:, first : first + size] = _by_numpy(keys[:, :, np.newaxis], cases[first : first + size])
    return numbers


def _by_numpy(keys: np.ndarray, cases: np.ndarray) -> np.ndarray:
    """keys : uint64[n_keys, 2, 1]."""
    # Words that are the same for all cases are arrays of one number, so that the first rounds, which have few others,
    # cost little.
    words = (np.ones(1, np.uint64), np.zeros(1, np.uint64), np.zeros(1, np.uint64), cases)
    keys_of_rounds = [(keys[:, 0] + np.uint64(low), keys[:, 1] + np.uint64(high)) for low, high in _STEPS]
    for low_key, high_key in keys_of_rounds[:-1]:
        first, third = words[1] ^ low_key, words[3] ^ high_key
        first, third = first ^ _upper(words[2], _MULTIPLIERS[1]), third ^ _upper(words[0], _MULTIPLIERS[0])
        words = (first, words[2] * np.uint64(_MULTIPLIERS[1]), third, words[0] * np.uint64(_MULTIPLIERS[0]))
    first = words[1] ^ keys_of_rounds[-1][0] ^ _upper(words[2], _MULTIPLIERS[1])  # of the last round this word alone
    return (first >> np.uint64(11)) * 2.0**-53


def _upper(words: np.ndarray, multiplier: int) -> np.ndarray:
    """Upper 64 of the 128 bits of words * multiplier, through four products of 32-bit halves.

    Worked out in place: another array for each step would leave the cache.
    """
    m_low, m_high = np.uint64(multiplier & 0xFFFFFFFF), np.uint64(multiplier >> 32)
    low, high = words & _LOW, words >> _HALF
    middle = low * m_low
    middle >>= _HALF
    middle += high * m_low
    low *= m_high
    low += middle & _LOW
    low >>= _HALF
    middle >>= _HALF
    high *= m_high
    high += middle
    high += low
    return high


@cache
def _machine_code() -> tuple[Any, Any]:
    """(function of a key's two words, the number of cases, and the addresses of cases and numbers; what owns its code,
    and is to be kept while it runs)."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    target = binding.Target.from_triple(binding.get_process_triple())
    module = binding.parse_assembly(str(_module()))
    engine = binding.create_mcjit_compiler(module, target.create_target_machine(jit=True))
    engine.finalize_object()
    prototype = ctypes.CFUNCTYPE(None, *[ctypes.c_uint64] * 3, *[ctypes.c_void_p] * 2)
    return prototype(engine.get_function_address("first_numbers")), engine


def _module() -> Any:
    """The loop over the cases of one key, in LLVM's language."""
    from llvmlite import ir

    word, double = ir.IntType(64), ir.DoubleType()
    module = ir.Module()
    kinds = [word, word, word, word.as_pointer(), double.as_pointer()]
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), kinds), "first_numbers")
    low_key, high_key, n_cases, cases, numbers = function.args
    before, loop, after = (function.append_basic_block(name) for name in ("before", "loop", "after"))
    ir.IRBuilder(before).branch(loop)
    code = ir.IRBuilder(loop)
    case = code.phi(word)
    words = word(1), word(0), word(0), code.load(code.gep(cases, [case]))
    for low, high in _STEPS:
        upper_0, lower_0 = _product(code, words[0], _MULTIPLIERS[0])
        upper_2, lower_2 = _product(code, words[2], _MULTIPLIERS[1])
        first = code.xor(code.xor(words[1], code.add(low_key, word(low))), upper_2)
        third = code.xor(code.xor(words[3], code.add(high_key, word(high))), upper_0)
        words = first, lower_2, third, lower_0
    number = code.fmul(code.uitofp(code.lshr(words[0], word(11)), double), double(2.0**-53))
    code.store(number, code.gep(numbers, [case]))
    following = code.add(case, word(1))
    case.add_incoming(word(0), before)
    case.add_incoming(following, loop)
    code.cbranch(code.icmp_unsigned("<", following, n_cases), loop, after)
    ir.IRBuilder(after).ret_void()
    return module


def _product(code: Any, value: Any, multiplier: int) -> tuple[Any, Any]:
    """(upper, lower) 64 of the 128 bits of value * multiplier."""
    from llvmlite import ir

    word, wide = ir.IntType(64), ir.IntType(128)
    product = code.mul(code.zext(value, wide), wide(multiplier))
    return code.trunc(code.lshr(product, wide(64)), word), code.trunc(product, word)
