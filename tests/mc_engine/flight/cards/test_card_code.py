"""The code of a card's threads: the processor's operations, no more and no fewer roundings, and the same bits.

Held without a card: the code assembles for each kind of card, holds no contracted operation, and
compiled for the processor gives the bits of the engine's own kernel.
"""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from assembler import assembled, ptxas
from processor_twin import ProcessorTwin
from shipped_kernels import MODELS, NAMES, kernel_call

from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import EngineError
from mc_engine.flight import flight
from mc_engine.flight.card_code import CAPABILITIES, PER_CASE, TRIPLE, choices_of_bits, ptx_of, thread_code
from mc_engine.lanes.kernel_cache import form_of
from mc_engine.model import AdaptiveStep
from mc_engine.studies.lane_speed import campaign_flight
from tests.benchmarks.card_speed import DAY

CASES = 8
LARGE = ("reentry", "geo_servicing")  # whose code takes longest to compile; they are slow tests as variants are
CAMPAIGNS = [
    name if name in MODELS and name not in LARGE else pytest.param(name, marks=pytest.mark.slow) for name in NAMES
]
_LANES = re.compile(r"call (?:<(\d+) x )?double>? @llvm\.fma\.")
_EXTREMES = re.compile(r"^\s*(?:min|max)\.f64\s+(%\w+),", re.MULTILINE)


@cache
def code_of(name):
    """(call of the campaign's kernel, code of its threads)."""
    call = kernel_call(name, CASES)
    return call, thread_code(call.func, call.args)


def check_bits(call, code):
    """The code of the threads, compiled for the processor, fills the arrays of the kernel's call with the same bits."""
    call()
    twin = list(call.args)
    for index in PER_CASE[2:]:
        twin[index] = np.full_like(call.args[index], -7.0)
    ProcessorTwin(code).fly_call(twin)
    for index in PER_CASE[2:]:
        assert twin[index].tobytes() == call.args[index].tobytes()


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_on_the_processor_the_code_gives_the_bits_of_the_kernel(name):
    call, code = code_of(name)
    assert call.func.file(form_of(call.args)).exists()  # the processor's code is kept when the cards' is made
    check_bits(call, code)


ADAPTIVE = AdaptiveStep(until=86_400.0, rtol=1e-9, method="tp86")


@pytest.mark.parametrize("method", ["gj9", *(pytest.param(name, marks=pytest.mark.slow) for name in ("abm12", "tp86"))])
def test_on_the_processor_methods_of_no_shipped_campaign_give_the_bits_of_the_kernel(method):
    day = campaign_flight(load_campaign(DAY), CASES)
    clock = ADAPTIVE if method == "tp86" else replace(day.model.clock, method=method)
    model, ids = replace(day.model, clock=clock), np.arange(CASES)
    call = flight.bound_flight(model, day.inputs, ids, day.seed, folder=day.folder, width=1)[0]
    check_bits(call, thread_code(call.func, call.args))


@pytest.mark.parametrize("capability", CAPABILITIES)
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_cards_round_where_the_processor_rounds(name, capability):
    """Every fma is the source's own; a minimum, which orders zeros, is used only where their sign does not count."""
    _, code = code_of(name)
    ptx = ptx_of(code, capability)
    assert len(re.findall(r"\bfma\.rn\.f64", ptx)) == sum(int(lanes or 1) for lanes in _LANES.findall(code))
    assert not re.search(r"\b(?:mad|fma)\.(?!rn\.f64|lo\.)|\.approx|\.ftz", ptx)
    for register in _EXTREMES.findall(ptx):
        used = [line for line in ptx.splitlines() if re.search(rf"{register}\b", line)]
        assert [line.split()[0].split(".")[0] for line in used] in (["max", "setp"], ["min", "setp"])


def assemblies():
    """Every campaign for every card; the code for others, which differs in one line, in the tests marked slow."""
    for campaign in CAMPAIGNS:
        for capability in CAPABILITIES:
            name, marks = getattr(campaign, "values", (campaign,))[0], [*getattr(campaign, "marks", ())]
            if name != "minimal" and capability != CAPABILITIES[-1]:
                marks.append(pytest.mark.slow)
            yield pytest.param(name, capability, marks=marks)


@pytest.mark.skipif(ptxas() is None, reason="ptxas is not installed: pip install nvidia-cuda-nvcc-cu12")
@pytest.mark.parametrize(("name", "capability"), [*assemblies()])
def test_the_code_assembles(name, capability):
    _, code = code_of(name)
    assert 0 < assembled(ptx_of(code, capability), capability).registers <= 255


def test_the_code_is_the_same_in_every_process():
    """The driver keeps what it has compiled by its text, so the text holds no address."""
    _, code = code_of("minimal")
    ptx = ptx_of(code, CAPABILITIES[0])
    assert "part_" in code
    assert not re.search(r"_ZN|x7f[0-9a-f]{10}", ptx)


CALLS = f"""
target triple = "{TRIPLE}"
declare double @other(double)
define double @caller(double %x) {{
  %y = call double @other(double %x)
  ret double %y
}}
"""


def test_what_a_process_wrote_before_does_not_show():
    """LLVM numbers the calls that it has written in a remark."""
    assert ptx_of(CALLS, CAPABILITIES[0]) == ptx_of(CALLS, CAPABILITIES[0])


def test_the_code_is_made_once_and_kept(monkeypatch):
    call, code = code_of("minimal")
    monkeypatch.setattr(call.func, "compiled", lambda form: pytest.fail("was compiled again"))
    assert thread_code(call.func, call.args) == code


@pytest.mark.parametrize("operation", ["fdiv afn float %x, %y", "call afn float @llvm.sqrt.f32(float %x)"])
def test_an_operation_without_a_rounding_is_an_error(operation):
    loose = f"""
target triple = "{TRIPLE}"
declare float @llvm.sqrt.f32(float)
define float @loose(float %x, float %y) {{
  %z = {operation}
  ret float %z
}}
"""
    with pytest.raises(EngineError, match=r"wrote (?:div|sqrt)\.approx\S* without a rounding, which"):
        ptx_of(loose, CAPABILITIES[0])


ZEROS = f"""
target triple = "{TRIPLE}"
define ptx_kernel void @zeros(ptr %x, ptr %z) {{
  %v = load double, ptr %x
  %below = fcmp olt double %v, 0.0
  %least = select i1 %below, double %v, double 0.0
  store double %least, ptr %z
  ret void
}}
"""


def test_the_back_end_takes_a_choice_for_a_minimum():
    """Why choices are made between bits: a card's minimum of -0.0 and 0.0 is -0.0, and the source's choice is 0.0."""
    assert "min.f64" in ptx_of(ZEROS, CAPABILITIES[0])
    assert "min.f64" not in ptx_of(choices_of_bits(ZEROS), CAPABILITIES[0])
