"""The falling ball with drag as an FMU, of FMI 2 or 3, for co-simulation and model exchange, compiled by the test.

Its continuous states are speed and height; `fall_time` and `impact_speed` are known from the start.
"""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

from tests.mc_engine.flight.falling_ball import CAMPAIGN

C = r"""
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
typedef struct { double t, v[12]; } Ball;  /* by value reference: mass 1, area 2, height 3, speed 4, altitude 5 */
static const double G = 9.81;
static double k(Ball *b) { return b->v[2] * 1.225 / 2 / b->v[1]; }
static double limit(Ball *b) { return sqrt(G / k(b)); }
static void start(Ball *b) { b->t = 0; b->v[1] = 10; b->v[2] = 0.02; b->v[3] = 500; b->v[4] = b->v[5] = 0; }
static void *made(void) { Ball *b = calloc(1, sizeof *b); start(b); return b; }
static void initialized(Ball *b) {
  b->v[4] = 0; b->v[5] = b->v[3];
  b->v[8] = acosh(exp(k(b) * b->v[3])) * limit(b) / G;
  b->v[9] = limit(b) * tanh(G * b->v[8] / limit(b));
}
static void rates(Ball *b) { b->v[6] = G - k(b) * b->v[4] * b->v[4]; b->v[7] = -b->v[4]; }
static int stepped(Ball *b, double t) {
  FAULT
  b->t = t; b->v[4] = limit(b) * tanh(G * t / limit(b)); b->v[5] = b->v[3] - log(cosh(G * t / limit(b))) / k(b);
  return 0;
}
#define EACH(i, n) for (size_t i = 0; i < n; i++)
static int got(Ball *b, const unsigned *r, size_t n, double *x) { rates(b); EACH(i, n) x[i] = b->v[r[i]]; return 0; }
static int set(Ball *b, const unsigned *r, size_t n, const double *x) { EACH(i, n) b->v[r[i]] = x[i]; return 0; }
#define SHARED(fmi) \
  void fmi##FreeInstance(void *b) { free(b); } \
  int fmi##ExitInitializationMode(void *b) { initialized(b); return 0; } \
  int fmi##Terminate(void *b) { return 0; } \
  int fmi##Reset(void *b) { RESET; start(b); return 0; } \
  int fmi##SetTime(void *b, double t) { ((Ball *)b)->t = t; return 0; } \
  int fmi##EnterEventMode(void *b) { return 0; } \
  int fmi##EnterContinuousTimeMode(void *b) { return 0; } \
  int fmi##GetContinuousStates(void *b, double *x, size_t n) { x[0] = ((Ball *)b)->v[4]; x[1] = ((Ball *)b)->v[5]; \
    return 0; } \
  int fmi##SetContinuousStates(void *b, const double *x, size_t n) { ((Ball *)b)->v[4] = x[0]; \
    ((Ball *)b)->v[5] = x[1]; return 0; } \
  int fmi##GetNominalsOfContinuousStates(void *b, double *x, size_t n) { x[0] = 10; x[1] = 100; return 0; } \
  int fmi##GetEventIndicators(void *b, double *x, size_t n) { return 0; }
SHARED(fmi2)
SHARED(fmi3)
static int derived(Ball *b, double *x) { rates(b); x[0] = b->v[6]; x[1] = b->v[7]; return 0; }
int fmi2GetDerivatives(void *b, double *x, size_t n) { return derived(b, x); }
int fmi3GetContinuousStateDerivatives(void *b, double *x, size_t n) { return derived(b, x); }
void *fmi2Instantiate(const char *a, int b, const char *c, const char *d, const void *e, int f, int g) {
  return made(); }
int fmi2SetupExperiment(void *b, int d, double tolerance, double t, int s, double stop) { return 0; }
int fmi2EnterInitializationMode(void *b) { return 0; }
int fmi2GetReal(void *b, const unsigned *r, size_t n, double *x) { return got(b, r, n, x); }
int fmi2SetReal(void *b, const unsigned *r, size_t n, const double *x) { return set(b, r, n, x); }
int fmi2SetInteger(Ball *b, const unsigned *r, size_t n, const int *x) { EACH(i, n) b->v[r[i]] = x[i]; return 0; }
int fmi2GetInteger(Ball *b, const unsigned *r, size_t n, int *x) { EACH(i, n) x[i] = b->v[r[i]]; return 0; }
int fmi2GetBoolean(Ball *b, const unsigned *r, size_t n, int *x) { EACH(i, n) x[i] = b->v[5] < 0; return 0; }
int fmi2DoStep(void *b, double t, double step, int n) { return stepped(b, t + step); }
int fmi2CompletedIntegratorStep(void *b, int n, int *event, int *end) { *event = *end = 0; return 0; }
int fmi2NewDiscreteStates(void *b, struct { int more, end, nominals, values, defined; double next; } *i) {
  i->more = i->end = i->nominals = i->values = i->defined = 0; return 0; }
void *fmi3InstantiateModelExchange(const char *a, const char *b, const char *c, bool d, bool e, void *f, void *g) {
  return made(); }
void *fmi3InstantiateCoSimulation(const char *a, const char *b, const char *c, bool d, bool e, bool f, bool g,
  const unsigned *h, size_t i, void *j, void *k, void *l) { return made(); }
int fmi3EnterInitializationMode(void *b, bool d, double tolerance, double t, bool s, double stop) { return 0; }
int fmi3GetFloat64(void *b, const unsigned *r, size_t n, double *x, size_t m) { return got(b, r, n, x); }
int fmi3SetFloat64(void *b, const unsigned *r, size_t n, const double *x, size_t m) { return set(b, r, n, x); }
int fmi3DoStep(void *b, double t, double step, bool n, bool *event, bool *end, bool *early, double *last) {
  *event = *end = *early = false; *last = t + step; return stepped(b, t + step); }
int fmi3CompletedIntegratorStep(void *b, bool n, bool *event, bool *end) { *event = *end = false; return 0; }
int fmi3UpdateDiscreteStates(void *b, bool *more, bool *end, bool *nominals, bool *values, bool *due, double *next) {
  *more = *end = *nominals = *values = *due = false; return 0; }
"""
PARAMETERS = {"mass": (1, 10.0), "drag_area": (2, 0.02), "height": (3, 500.0)}
OUTPUTS = {"speed": 4, "altitude": 5, "fall_time": 8, "impact_speed": 9}
DERIVATIVES = {"speed_rate": (6, 4), "altitude_rate": (7, 5)}  # (value reference, that of the state)


def _fmi2():
    known = [*((name, 'causality="parameter" variability="fixed" initial="exact"', ref, f'start="{start}"')
               for name, (ref, start) in PARAMETERS.items()),
             *((name, 'causality="output"', ref, "") for name, ref in OUTPUTS.items()),
             *((name, 'causality="local"', ref, f'derivative="{4 + place}"')
               for place, (name, (ref, _)) in enumerate(DERIVATIVES.items()))]  # fmt: skip
    lines = [f'<ScalarVariable name="{name}" valueReference="{ref}" {kind}><Real {more}/></ScalarVariable>'
             for name, kind, ref, more in known]  # fmt: skip
    lines += [
        '<ScalarVariable name="number" valueReference="10" causality="parameter" variability="fixed" '
        'initial="exact"><Integer start="1"/></ScalarVariable>',
        '<ScalarVariable name="landed" valueReference="11" variability="discrete"><Boolean/></ScalarVariable>',
    ]
    outputs = "".join(f'<Unknown index="{place}"/>' for place in range(4, 8))
    states = '<Unknown index="8"/><Unknown index="9"/>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="ball" guid="ball" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="ball" completedIntegratorStepNotNeeded="true"/>
<CoSimulation modelIdentifier="ball" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>{"".join(lines)}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{states}</Derivatives><InitialUnknowns>{outputs}{states}
</InitialUnknowns></ModelStructure></fmiModelDescription>"""


def _fmi3():
    lines = ['<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>']
    lines += [f'<Float64 name="{name}" valueReference="{ref}" causality="parameter" variability="fixed" '
              f'initial="exact" start="{start}"/>' for name, (ref, start) in PARAMETERS.items()]  # fmt: skip
    lines += [f'<Float64 name="{name}" valueReference="{ref}" causality="output"/>' for name, ref in OUTPUTS.items()]
    lines += [f'<Float64 name="{name}" valueReference="{ref}" derivative="{state}"/>'
              for name, (ref, state) in DERIVATIVES.items()]  # fmt: skip
    structure = "".join(f'<Output valueReference="{ref}"/>' for ref in OUTPUTS.values())
    structure += "".join(f'<ContinuousStateDerivative valueReference="{ref}"/>' for ref, _ in DERIVATIVES.values())
    structure += "".join(f'<InitialUnknown valueReference="{ref}"/>' for ref in (4, 5, 8, 9, 6, 7))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="ball" instantiationToken="ball">
<ModelExchange modelIdentifier="ball"/>
<CoSimulation modelIdentifier="ball" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>{"".join(lines)}</ModelVariables>
<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"""


def ball_fmu(path, fmi=2, fault="", platform=None, reset=""):
    """Write the FMU.

    fault, reset : lines of C in each step, and in each reset.  platform : of its library, by default this machine's.
    """
    import fmpy

    source, library = path.with_suffix(".c"), path.with_suffix(".so")
    headers = (Path(fmpy.__file__).parent / "c-code").glob("fmi[23]Functions.h")
    names = {name for header in headers for name in re.findall(r"\b(fmi[23]\w+)TYPE\s+fmi", header.read_text())}
    code = C.replace("FAULT", fault).replace("RESET", reset)
    there = {*re.findall(r"\b(fmi[23]\w+)\(", code)}
    there |= {f"fmi{version}{name}" for version in "23" for name in re.findall(r"fmi##(\w+)", C)}
    idle = [f"int {name}(void) {{ return 3; }}" for name in sorted(names - there)]  # which no case calls
    source.write_text("\n".join([code, *idle]))
    compiler = shutil.which("cc") or shutil.which("gcc")
    subprocess.run([compiler, "-O1", "-w", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    machine = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _fmi2() if fmi == 2 else _fmi3())
        archive.write(library, f"binaries/{platform or machine}/ball{fmpy.sharedLibraryExtension}")
    source.unlink()
    library.unlink()


FMU = """
[simulator]
fmu = "ball.fmu"
stop_time_s = 20.0
step_s = 0.05
title = "A falling ball with drag"
{options}
[simulator.parameter]
mass_kg = {{ default = 10.0, low = 0.1, variable = "mass", description = "mass" }}
drag_area_m2 = {{ default = 0.02, low = 0.0, unit = "m^2", variable = "drag_area", description = "drag area" }}
height_m = {{ default = 500.0, low = 0.0, variable = "height", description = "height" }}
[simulator.metric]
fall_time_s = {{ variable = "fall_time", description = "time to the ground" }}
impact_speed_m_s = {{ variable = "impact_speed", description = "speed at the ground" }}
{metrics}
[simulator.output]
speed_m_s = {{ variable = "speed", description = "speed" }}
"""


def fmu_campaign(folder, cases=100, fmi=2, options="", metrics="", **how):
    """A campaign of the FMU in a new folder.  options, metrics : lines of the table [simulator]."""
    folder.mkdir()
    ball_fmu(folder / "ball.fmu", fmi, **how)
    text = CAMPAIGN.format(flies="", cases=cases) + FMU.format(options=options, metrics=metrics)
    (folder / "campaign.toml").write_text(text)
    return folder / "campaign.toml"
