// Hand-written lanes: eight cases in a vector with AVX-512, four with AVX2; classical Runge-Kutta, for the low orbit and
// the flexible satellite.
//
//     g++ -O3 -march=native -ffast-math -shared -fPIC -pthread lanes.cpp -o lanes.so
//
// What an engineer writes who has one problem and a week: the peer that the engine's kernels are measured against.
// The equations are those of models/drag_orbit.py and models/satellite.py.  SI.

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace {

#define ALWAYS inline __attribute__((always_inline))

#if defined(__AVX512F__) || !defined(__AVX2__)
constexpr int W = 8;
#else
constexpr int W = 4;
#endif
typedef double V __attribute__((vector_size(8 * W)));
typedef long long I __attribute__((vector_size(8 * W)));

ALWAYS V splat(double x) { return V{} + x; }
ALWAYS V load(const double* p) { V v; __builtin_memcpy(&v, p, sizeof v); return v; }
ALWAYS void store(double* p, V v) { __builtin_memcpy(p, &v, sizeof v); }

#if defined(__AVX512F__)
ALWAYS V sqrt(V x) { return (V)_mm512_sqrt_pd((__m512d)x); }
ALWAYS V round(V x) { return (V)_mm512_roundscale_pd((__m512d)x, 0); }
ALWAYS V scale(V x, V n) { return (V)_mm512_scalef_pd((__m512d)x, (__m512d)n); }
ALWAYS V least(V x, V y) { return (V)_mm512_min_pd((__m512d)x, (__m512d)y); }
#elif defined(__AVX2__)
ALWAYS V sqrt(V x) { return (V)_mm256_sqrt_pd((__m256d)x); }
ALWAYS V round(V x) { return (V)_mm256_round_pd((__m256d)x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
ALWAYS V least(V x, V y) { return (V)_mm256_min_pd((__m256d)x, (__m256d)y); }
// x 2^n by the bits of the exponent; 2^n must be a normal number
ALWAYS V scale(V x, V n) {
    const __m256i bits = _mm256_cvtepi32_epi64(_mm256_cvtpd_epi32((__m256d)n));
    return (V)_mm256_castsi256_pd(_mm256_slli_epi64(_mm256_add_epi64(bits, _mm256_set1_epi64x(1023)), 52)) * x;
}
#else
ALWAYS V sqrt(V x) { for (int i = 0; i < W; i++) x[i] = std::sqrt(x[i]); return x; }
ALWAYS V round(V x) { for (int i = 0; i < W; i++) x[i] = std::nearbyint(x[i]); return x; }
ALWAYS V scale(V x, V n) { for (int i = 0; i < W; i++) x[i] = std::ldexp(x[i], int(n[i])); return x; }
ALWAYS V least(V x, V y) { for (int i = 0; i < W; i++) x[i] = std::min(x[i], y[i]); return x; }
#endif

// Cody-Waite reduction, Taylor terms by Estrin's scheme
ALWAYS V exp(V x) {
    const V n = round(x * 1.4426950408889634);
    const V r = x - n * 6.93147180369123816490e-01 - n * 1.90821492927058770002e-10;
    const V r2 = r * r, r4 = r2 * r2;
    const V start = 1.0 + r + (0.5 + r * (1 / 6.0)) * r2;
    const V low = (1 / 24.0 + r * (1 / 120.0)) + (1 / 720.0 + r * (1 / 5040.0)) * r2;
    const V high = (1 / 40320.0 + r * (1 / 362880.0)) + (1 / 3628800.0 + r * (1 / 39916800.0)) * r2;
    return scale(start + r4 * (low + r4 * high), n);
}

// y + h k, all fields
template <int N> ALWAYS void ahead(V* r, const V* s, double h, const V* k) {
#pragma GCC unroll 32
    for (int i = 0; i < N; i++) r[i] = s[i] + h * k[i];
}

// One step from t.  The sum of the slopes grows as they come, so that one slope is kept and not four.
// What depends on time alone is the same for all lanes: `now` holds it at t, and at t + h afterwards.
template <int N, class F> ALWAYS void rk4(const F& f, double t, double h, V* s, double& now) {
    V k[N], sum[N], y[N];
    const double middle = f.forcing(t + 0.5 * h), end = f.forcing(t + h);
    f(now, s, k);
#pragma GCC unroll 32
    for (int i = 0; i < N; i++) sum[i] = k[i];
    ahead<N>(y, s, 0.5 * h, k);
    f(middle, y, k);
    ahead<N>(sum, sum, 2.0, k);
    ahead<N>(y, s, 0.5 * h, k);
    f(middle, y, k);
    ahead<N>(sum, sum, 2.0, k);
    ahead<N>(y, s, h, k);
    f(end, y, k);
#pragma GCC unroll 32
    for (int i = 0; i < N; i++) s[i] += h / 6.0 * (sum[i] + k[i]);
    now = end;
}

struct Orbit {
    static constexpr int states = 6, parameters = 7;
    V drag;
    explicit Orbit(const V* p) : drag(p[6]) {}
    void first(const V* p, V* s) const { std::copy(p, p + 6, s); }
    double forcing(double) const { return 0.0; }
    ALWAYS void operator()(double, const V* s, V* k) const {
        const double mu = 3.986004418e14, re = 6378136.3, j2 = 1.08262668e-3, rate = 7.292115e-5;
        const V x = s[0], y = s[1], z = s[2], vx = s[3], vy = s[4], vz = s[5];
        const V r2 = x * x + y * y + z * z, r = sqrt(r2), u2 = 1.0 / r2;
        const V g = -mu * (u2 * u2) * r;
        const V q = (1.5 * j2 * mu * re * re) * (u2 * u2 * u2) * r, w = 5.0 * z * z * u2;
        const V ux = vx + rate * y, uy = vy - rate * x;
        const V density = 3.725e-12 * exp((r - (re + 400e3)) * (-1.0 / 58515.0));
        const V d = drag * density * sqrt(ux * ux + uy * uy + vz * vz);
        const V a = g + q * (w - 1.0), b = g + q * (w - 3.0);
        k[0] = vx, k[1] = vy, k[2] = vz, k[3] = a * x + d * ux, k[4] = a * y + d * uy, k[5] = b * z + d * vz;
    }
};

struct Satellite {
    static constexpr int states = 18, parameters = 10;
    V jx, jy, jz, ixx, iyy, izz, ixy, ixz, iyz, offset;
    explicit Satellite(const V* p)
        : jx(p[0]), jy(p[1]), jz(p[2]), ixx(p[3]), iyy(p[4]), izz(p[5]), ixy(p[6]), ixz(p[7]), iyz(p[8]), offset(p[9]) {}
    void first(const V*, V* s) const {
        const double start[7] = {0.07, -0.05, -0.04, 0.4, 0.2, 0.4, -0.8};
        for (int i = 0; i < 18; i++) s[i] = splat(i < 7 ? start[i] : 0.0);
    }
    double forcing(double t) const { return std::sin(t); }
    ALWAYS void operator()(double sine, const V* s, V* k) const {
        constexpr double c[3][4] = {{7.0, -1.2, 1.1, 1.2}, {1.2, 0.9, 2.5, -2.6}, {2.2, -1.7, -0.8, -1.1}};
        constexpr double f[4] = {0.7, 1.0, 1.8, 2.5}, xi[4] = {0.0056, 0.0086, 0.0128, 0.0252}, w0 = 1.078e-3;
        const V wx = s[0], wy = s[1], wz = s[2], q0 = s[3], q1 = s[4], q2 = s[5], q3 = s[6];
        const V *a = s + 7, *b = s + 11;
        const I fast = wx * wx + wy * wy + wz * wz >= 0.01;
        const V kd = fast ? splat(200.0) : splat(20.0), kp = fast ? splat(2.5) : splat(5.0);
        const V ki = fast ? splat(0.02) : splat(0.1);
        const V x = -kd * wx - kp * q1 - ki * (s[15] - 1.5 * (q1 - 0.2));
        const V y = -kd * wy - kp * q2 - ki * (s[16] - 1.5 * (q2 - 0.4));
        const V z = -kd * wz - kp * q3 - ki * (s[17] - 1.5 * (q3 + 0.8));
        const V share = least(splat(1.0), 0.5 / sqrt(x * x + y * y + z * z + 1e-300));
        const V td = 2.8867513459481287e-4 * (sine + offset);
        V h[3] = {jx * wx, jy * wy, jz * wz}, e[4], force[3] = {};
#pragma GCC unroll 4
        for (int j = 0; j < 4; j++) e[j] = 2.0 * xi[j] * f[j] * b[j] + f[j] * f[j] * a[j];
#pragma GCC unroll 3
        for (int i = 0; i < 3; i++)
#pragma GCC unroll 4
            for (int j = 0; j < 4; j++) h[i] += c[i][j] * b[j], force[i] += c[i][j] * e[j];
        const V tx = wz * h[1] - wy * h[2] + share * x + td + force[0];
        const V ty = wx * h[2] - wz * h[0] + share * y + td + force[1];
        const V tz = wy * h[0] - wx * h[1] + share * z + td + force[2];
        const V d[3] = {ixx * tx + ixy * ty + ixz * tz, ixy * tx + iyy * ty + iyz * tz, ixz * tx + iyz * ty + izz * tz};
        const V rx = wx + w0 * (2.0 * (q1 * q2 + q0 * q3));
        const V ry = wy + w0 * (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3);
        const V rz = wz + w0 * (2.0 * (q2 * q3 - q0 * q1));
        k[0] = d[0], k[1] = d[1], k[2] = d[2];
        k[3] = -0.5 * (q1 * rx + q2 * ry + q3 * rz), k[4] = 0.5 * (q0 * rx + q2 * rz - q3 * ry);
        k[5] = 0.5 * (q0 * ry + q3 * rx - q1 * rz), k[6] = 0.5 * (q0 * rz + q1 * ry - q2 * rx);
#pragma GCC unroll 4
        for (int i = 0; i < 4; i++) {
            k[7 + i] = b[i];
            k[11 + i] = -e[i] - (c[0][i] * d[0] + c[1][i] * d[1] + c[2][i] * d[2]);
        }
        k[15] = 0.025 * wx + 0.005 * q1, k[16] = 0.025 * wy + 0.005 * q2, k[17] = 0.025 * wz + 0.005 * q3;
    }
};

template <class Problem> void fly_cases(const double* p, double* out, long n, long begin, long end, long steps, double h) {
    for (long c = begin; c < end; c += W) {
        V given[Problem::parameters];
        for (int i = 0; i < Problem::parameters; i++) given[i] = load(p + i * n + c);
        const Problem problem(given);
        V s[Problem::states];
        problem.first(given, s);
        double now = problem.forcing(0.0);
        for (long k = 0; k < steps; k++) rk4<Problem::states>(problem, k * h, h, s, now);
        for (int i = 0; i < Problem::states; i++) store(out + i * n + c, s[i]);
    }
}

// n must be a multiple of the number of lanes
template <class Problem> void fly(const double* p, double* out, long n, long steps, double h, int threads) {
    const long blocks = n / W, share = (blocks + threads - 1) / threads * W;
    std::vector<std::thread> workers;
    for (long begin = share; begin < n; begin += share)
        workers.emplace_back(fly_cases<Problem>, p, out, n, begin, std::min(begin + share, n), steps, h);
    fly_cases<Problem>(p, out, n, 0, std::min(share, n), steps, h);
    for (auto& one : workers) one.join();
}

}  // namespace

extern "C" int lanes() { return W; }
extern "C" void orbit(const double* p, double* out, long n, long steps, double h, int threads) {
    fly<Orbit>(p, out, n, steps, h, threads);
}
extern "C" void satellite(const double* p, double* out, long n, long steps, double h, int threads) {
    fly<Satellite>(p, out, n, steps, h, threads);
}
