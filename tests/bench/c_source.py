"""Straight-line arithmetic as C code, for one environment or several in SIMD lanes."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any

from .straight_line import StraightLine

# One loop computes the sines and cosines of all angles, so that the compiler can vectorise it:
# reduction to [-pi/4, pi/4] in three parts (Cody and Waite 1980), polynomials of FreeBSD's msun
# (Sun Microsystems 1993); for angles up to 1e5 rad.
_BEGIN = """
#include <stdint.h>
#include <time.h>
#if LANES == 1
typedef double real;
#else
typedef double real __attribute__((vector_size(8 * LANES), aligned(8)));
#endif
#define CONSTANT(x) ((real){0} + (x))

static inline double as_double(uint64_t x) { double y; __builtin_memcpy(&y, &x, 8); return y; }
static inline uint64_t as_bits(double x) { uint64_t y; __builtin_memcpy(&y, &x, 8); return y; }

static void sines_cosines(const double* x, double* sines, double* cosines) {
  for (int i = 0; i < JOINTS * LANES; i++) {
    const double shifted = x[i] * 0x1.45f306dc9c883p-1 + 0x1.8p52, k = shifted - 0x1.8p52;
    const double r =
        ((x[i] - k * 0x1.921fb544p0) - k * 0x1.0b4611a6p-34) - k * 0x1.3198a2e037073p-69;
    const double z = r * r;
    const double sine = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const double half = 0.5 * z, near = 1.0 - half;
    const double cosine = near + (((1.0 - near) - half) + z * z * (4.16666666666666019037e-02
        + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09
        + z * -1.13596475577881948265e-11))))));
    const uint64_t quadrant = as_bits(shifted), s = as_bits(sine), c = as_bits(cosine);
    const uint64_t exchange = (s ^ c) & -(quadrant & 1);
    sines[i] = as_double((s ^ exchange) ^ ((quadrant & 2) << 62));
    cosines[i] = as_double((c ^ exchange) ^ (((quadrant + 1) & 2) << 62));
  }
}
"""

# Each evaluation in `repeat` depends on the previous one, as in an integrator. The step of 1e-12 s
# keeps the state nearly constant.
_END = """
void evaluate(const real* q, const real* v, const real* tau, real* a) {
  real angle[JOINTS], sine[JOINTS], cosine[JOINTS];
  angles(q, angle);
  sines_cosines((double*)angle, (double*)sine, (double*)cosine);
  accelerations(sine, cosine, v, tau, a);
}

long long repeat(long long times, real* q, real* v, const real* tau) {
  struct timespec begun, ended;
  real a[N];
  clock_gettime(CLOCK_MONOTONIC, &begun);
  for (long long i = 0; i < times; i++) {
    evaluate(q, v, tau, a);
    for (int k = 0; k < N; k++) { q[k] += 1e-12 * v[k]; v[k] += 1e-12 * a[k]; }
  }
  clock_gettime(CLOCK_MONOTONIC, &ended);
  return 1000000000LL * (ended.tv_sec - begun.tv_sec) + ended.tv_nsec - begun.tv_nsec;
}
"""


def c_source(line: StraightLine, lanes: int) -> str:
    """Generate the functions `evaluate` and `repeat`.

    Arrays are coordinate-major: a coordinate of all environments, then the next one. `repeat`
    returns the time of its evaluations [ns].
    """
    joints = line.angles.numel_out(0)
    n = line.accelerations.numel_out(0)
    sizes = f"#define LANES {lanes}\n#define JOINTS {joints}\n#define N {n}\n"
    functions = "".join(_function(each) for each in (line.angles, line.accelerations))
    return sizes + _BEGIN + functions + _END


def _function(function: Any) -> str:
    inputs = [f"const real* in{i}" for i in range(function.n_in())]
    numbers = ", ".join(f"w{i}" for i in range(function.sz_w()))
    head = f"\nstatic void {function.name()}({', '.join(inputs)}, real* restrict out) {{\n"
    return f"{head}  real {numbers};\n" + "".join(_statements(function)) + "}\n"


def _statements(function: Any) -> Iterator[str]:
    ca = import_module("casadi")
    forms = {
        ca.OP_ADD: "{} + {}",
        ca.OP_SUB: "{} - {}",
        ca.OP_MUL: "{} * {}",
        ca.OP_DIV: "{} / {}",
        ca.OP_INV: "1.0 / {}",
        ca.OP_NEG: "-{}",
        ca.OP_SQ: "{0} * {0}",
        ca.OP_TWICE: "{0} + {0}",
    }
    for i in range(function.n_instructions()):
        kind, given = function.instruction_id(i), function.instruction_input(i)
        to = function.instruction_output(i)
        if kind == ca.OP_OUTPUT:
            yield f"  out[{to[1]}] = w{given[0]};\n"
            continue
        if kind == ca.OP_INPUT:
            value = f"in{given[0]}[{given[1]}]"
        elif kind == ca.OP_CONST:
            value = f"CONSTANT({function.instruction_constant(i)!r})"
        else:
            value = forms[kind].format(*(f"w{each}" for each in given))
        yield f"  w{to[0]} = {value};\n"
