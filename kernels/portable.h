// The only file that knows whether it is OpenCL C or C++, and how wide a vector is.
//
// Kernels are width-generic: with -DVW=8 a `real` is a float8 whose lanes hold eight samples; with -DVW=1 a float.
// In C++ (host code and tests) a `real` is a double, so that one source serves as its own double-precision form.
// Rules for shared headers: constants are written LIT(0.1), comparisons give a `mask`, branches on `real` are
// written real_select(mask, a, b), and nothing else of either language's library is used.
#ifndef PARIAN_PORTABLE_H
#define PARIAN_PORTABLE_H

#ifdef __cplusplus

#include <algorithm>
#include <cmath>
#include <cstdint>
#define KERNEL_HEADER_BEGIN namespace parian::kernels {
#define KERNEL_HEADER_END }
#define SHARED inline
#define LIT(x) x
#define CONSTANTS(T) const auto&  // a T, or the same in double
#define PARALLEL_LIMIT 1e-28      // squared sine below which two directions count as parallel
#define TINY 1e-280               // squared length below which a vector counts as zero

KERNEL_HEADER_BEGIN
using real = double;
using mask = bool;
using uint = std::uint32_t;
using i64 = std::int64_t;
struct alignas(16) float4 {
  float x, y, z, w;
};
SHARED real real_splat(double x) { return x; }
SHARED real real_select(mask m, real a, real b) { return m ? a : b; }
SHARED real real_sqrt(real x) { return std::sqrt(x); }
SHARED real real_rsqrt(real x) { return 1.0 / std::sqrt(x); }
SHARED real real_exp(real x) { return std::exp(x); }
SHARED real real_expm1(real x) { return std::expm1(x); }
SHARED real real_min(real a, real b) { return std::min(a, b); }
SHARED real real_max(real a, real b) { return std::max(a, b); }
SHARED real real_abs(real x) { return std::fabs(x); }
KERNEL_HEADER_END

#else  // OpenCL C 1.2

#define KERNEL_HEADER_BEGIN
#define KERNEL_HEADER_END
#define SHARED static inline
#define LIT(x) (x##f)
#define CONSTANTS(T) T
// Before a loop over a private array: a GPU keeps the array in registers once every index is a constant.
#define UNROLL _Pragma("unroll")
#define PARALLEL_LIMIT 1e-12f
#define TINY 1e-36f

#ifndef VW
#define VW 1
#endif
#if VW == 1
typedef float real;
typedef int mask;
typedef uint ureal;
#define real_from_bits(u) convert_float(u)
#define real_sum(v) (v)
#elif VW == 4
typedef float4 real;
typedef int4 mask;
typedef uint4 ureal;
#define real_from_bits(u) convert_float4(u)
#define real_sum(v) (((v).s0 + (v).s1) + ((v).s2 + (v).s3))
#elif VW == 8
typedef float8 real;
typedef int8 mask;
typedef uint8 ureal;
#define real_from_bits(u) convert_float8(u)
#define real_sum(v) ((((v).s0 + (v).s1) + ((v).s2 + (v).s3)) + (((v).s4 + (v).s5) + ((v).s6 + (v).s7)))
#elif VW == 16
typedef float16 real;
typedef int16 mask;
typedef uint16 ureal;
#define real_from_bits(u) convert_float16(u)
#define real_sum(v)                                                                      \
  (((((v).s0 + (v).s1) + ((v).s2 + (v).s3)) + (((v).s4 + (v).s5) + ((v).s6 + (v).s7))) + \
   ((((v).s8 + (v).s9) + ((v).sa + (v).sb)) + (((v).sc + (v).sd) + ((v).se + (v).sf))))
#else
#error "VW is 1, 4, 8 or 16"
#endif

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#if VW == 1
#define WIDE(type) type
#else
#define WIDE(type) PASTE(type, VW)
#endif
#define as_real(x) WIDE(as_float)(x)
#define as_mask(x) WIDE(as_int)(x)
#define convert_real(x) WIDE(convert_float)(x)
#define convert_ureal(x) WIDE(convert_uint)(x)

// Lanes: their numbers, and what each of them reads from memory at its own index.
#if VW == 1
#define LANES 0u
#define FROM_LANES(read) (read(0))
#define LANE(v, lane) (v)
#elif VW == 4
#define LANES ((uint4)(0, 1, 2, 3))
#define FROM_LANES(read) ((float4)(read(0), read(1), read(2), read(3)))
#define LANE(v, lane) ((v).s##lane)
#elif VW == 8
#define LANES ((uint8)(0, 1, 2, 3, 4, 5, 6, 7))
#define FROM_LANES(read) ((float8)(read(0), read(1), read(2), read(3), read(4), read(5), read(6), read(7)))
#define LANE(v, lane) ((v).s##lane)
#else
#define LANES ((uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#define FROM_LANES(read)                                                                                        \
  ((float16)(read(0), read(1), read(2), read(3), read(4), read(5), read(6), read(7), read(8), read(9), read(a), \
             read(b), read(c), read(d), read(e), read(f)))
#define LANE(v, lane) ((v).s##lane)
#endif

typedef long i64;
SHARED real real_splat(float x) { return (real)(x); }
SHARED real real_select(mask m, real a, real b) { return select(b, a, m); }
SHARED real real_sqrt(real x) { return sqrt(x); }
SHARED real real_rsqrt(real x) { return rsqrt(x); }
SHARED real real_exp(real x) { return exp(x); }
SHARED real real_min(real a, real b) { return fmin(a, b); }
SHARED real real_max(real a, real b) { return fmax(a, b); }
SHARED real real_abs(real x) { return fabs(x); }
// The built-in expm1 is scalar on some CPU drivers: a series below 0.4, where exp(x) - 1 would cancel, and exp above.
SHARED real real_expm1(real x) {
  const real series =
      x * (1.0f + x * (0.5f + x * (1.0f / 6.0f +
                                   x * (1.0f / 24.0f +
                                        x * (1.0f / 120.0f +
                                             x * (1.0f / 720.0f + x * (1.0f / 5040.0f + x * (1.0f / 40320.0f))))))));
  return real_select(fabs(x) < 0.4f, series, exp(x) - 1.0f);
}

#endif

KERNEL_HEADER_BEGIN

// Three reals: a point or direction, or eight of them side by side.
typedef struct {
  real x, y, z;
} real3;

SHARED real3 real3_make(real x, real y, real z) {
  real3 v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}
SHARED real3 real3_sub(real3 a, real3 b) { return real3_make(a.x - b.x, a.y - b.y, a.z - b.z); }
SHARED real3 real3_scale(real3 a, real s) { return real3_make(a.x * s, a.y * s, a.z * s); }
SHARED real3 real3_madd(real3 a, real3 b, real s) {  // a + b s
  return real3_make(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}
SHARED real real3_dot(real3 a, real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SHARED real3 real3_cross(real3 a, real3 b) {
  return real3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
SHARED real3 real3_normalize(real3 a) { return real3_scale(a, real_rsqrt(real3_dot(a, a))); }
SHARED real3 real3_select(mask m, real3 a, real3 b) {
  return real3_make(real_select(m, a.x, b.x), real_select(m, a.y, b.y), real_select(m, a.z, b.z));
}

KERNEL_HEADER_END

#endif
