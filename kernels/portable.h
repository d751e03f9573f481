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
SHARED bool mask_all(mask m) { return m; }
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
#define SHARED static inline __attribute__((always_inline))
#define LIT(x) (x##f)
#define CONSTANTS(T) T
// Before a loop over a private array: a GPU keeps the array in registers once every index is a constant.
#define UNROLL _Pragma("unroll")
// Before a loop whose rounds a GPU should not have in its registers side by side.
#define ROLLED _Pragma("nounroll")
// First in a block of which nothing steers control flow: products and sums may be fused.
#define CONTRACT _Pragma("OPENCL FP_CONTRACT ON")
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
#elif VW == 4
typedef float4 real;
typedef int4 mask;
typedef uint4 ureal;
#define real_from_bits(u) convert_float4(u)
#define sum_of_half(v) ((v).s0 + (v).s1)
#elif VW == 8
typedef float8 real;
typedef int8 mask;
typedef uint8 ureal;
#define real_from_bits(u) convert_float8(u)
#define sum_of_half(v) (((v).s0 + (v).s1) + ((v).s2 + (v).s3))
#elif VW == 16
typedef float16 real;
typedef int16 mask;
typedef uint16 ureal;
#define real_from_bits(u) convert_float16(u)
#define sum_of_half(v) ((((v).s0 + (v).s1) + ((v).s2 + (v).s3)) + (((v).s4 + (v).s5) + ((v).s6 + (v).s7)))
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
#define as_ureal(x) WIDE(as_uint)(x)
#define convert_real(x) WIDE(convert_float)(x)
#define convert_ureal(x) WIDE(convert_uint)(x)
#define convert_mask(x) WIDE(convert_int)(x)
#if VW == 1
#define round_to_mask(x) convert_int_rte(x)
#else
#define round_to_mask(x) PASTE(PASTE(convert_int, VW), _rte)(x)
#endif

// mask_all tells whether something is so in all lanes, lanes_of in which, a bit for each; the built-in all() tests one
// by one on some CPU drivers.
//
// Masks are never negated as vectors, and no integer vector is compared with a number by min or max: Oclgrind 21.10
// does both wrongly. What isn't so in some lane isn't so in all.
//
// Lanes: the lower half of them takes samples of half A, the upper one of half B; with one lane a work-item has either.
// LANES numbers them within their half. READ_PAIRS and READ_FOURS read a float2 or float4 per lane at its own index, of
// which X, Y, Z, W (READ_XYZ: but W) are vectors of the components: loads of whole elements, then transposed with
// two-operand shuffles, which every compiler makes good code of. SIDE_BY_SIDE numbers all lanes, and OF_EACH lists
// something for each.
#define INDEX(index, lane) (((const uint*)&(index))[lane])
#define ELEMENT(v, lane) (((const float*)&(v))[lane])
#if VW == 1
#define SIDE_BY_SIDE 0u
#define OF_EACH(read) read(0)
#define mask_all(m) (m)
#define lanes_of(m) ((m) ? 1u : 0u)
#define LANES 0u
#define LANE(v, lane) (v)
#define READ_PAIRS(array, index, X, Y) \
  const float2 pair_ = array[index];   \
  const real X = pair_.x, Y = pair_.y;
#define READ_XYZ(array, index, X, Y, Z) \
  const float4 four_ = array[index];    \
  const real X = four_.x, Y = four_.y, Z = four_.z;
#define READ_FOURS(array, index, X, Y, Z, W) \
  READ_XYZ(array, index, X, Y, Z)            \
  const real W = four_.w;
#else
#define LANE(v, lane) ((v).s##lane)
#if VW == 4
#define LANES ((uint4)(0, 1, 0, 1))
#define SIDE_BY_SIDE ((uint4)(0, 1, 2, 3))
#define OF_EACH(read) read(0), read(1), read(2), read(3)
#define BOTH_HALVES(type, a, b) ((type##4)((type##2)(a), (type##2)(b)))
#define PAIRS_FROM(read, k) read(k), read(k + 1)
#define FOURS_FROM(read, k) read(k)
#define LOW_OF(a, b) ((float4)(a.s0, b.s0, a.s1, b.s1))
#define HIGH_OF(a, b) ((float4)(a.s2, b.s2, a.s3, b.s3))
#define FIRST_OF(a, b) ((float4)(a.s01, b.s01))
#define LAST_OF(a, b) ((float4)(a.s23, b.s23))
#elif VW == 8
#define LANES ((uint8)(0, 1, 2, 3, 0, 1, 2, 3))
#define SIDE_BY_SIDE ((uint8)(0, 1, 2, 3, 4, 5, 6, 7))
#define OF_EACH(read) read(0), read(1), read(2), read(3), read(4), read(5), read(6), read(7)
#define BOTH_HALVES(type, a, b) ((type##8)((type##4)(a), (type##4)(b)))
#define PAIRS_FROM(read, k) read(k), read(k + 1), read(k + 2), read(k + 3)
#define FOURS_FROM(read, k) read(k), read(k + 4)
#define LOW_OF(a, b) ((float8)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5))
#define HIGH_OF(a, b) ((float8)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7))
#define FIRST_OF(a, b) ((float8)(a.s01, b.s01, a.s45, b.s45))
#define LAST_OF(a, b) ((float8)(a.s23, b.s23, a.s67, b.s67))
#else
#define LANES ((uint16)(0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7))
#define SIDE_BY_SIDE ((uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#define OF_EACH(read)                                                                                           \
  read(0), read(1), read(2), read(3), read(4), read(5), read(6), read(7), read(8), read(9), read(10), read(11), \
      read(12), read(13), read(14), read(15)
#define BOTH_HALVES(type, a, b) ((type##16)((type##8)(a), (type##8)(b)))
#define PAIRS_FROM(read, k) \
  read(k), read(k + 1), read(k + 2), read(k + 3), read(k + 4), read(k + 5), read(k + 6), read(k + 7)
#define FOURS_FROM(read, k) read(k), read(k + 4), read(k + 8), read(k + 12)
#define LOW_OF(a, b) \
  ((float16)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5, a.s8, b.s8, a.s9, b.s9, a.sc, b.sc, a.sd, b.sd))
#define HIGH_OF(a, b) \
  ((float16)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7, a.sa, b.sa, a.sb, b.sb, a.se, b.se, a.sf, b.sf))
#define FIRST_OF(a, b) ((float16)(a.s01, b.s01, a.s45, b.s45, a.s89, b.s89, a.scd, b.scd))
#define LAST_OF(a, b) ((float16)(a.s23, b.s23, a.s67, b.s67, a.sab, b.sab, a.sef, b.sef))
#endif
#define READ_PAIRS(array, index, X, Y)                                                                     \
  const real low_ = (real)(PAIRS_FROM(READ_ELEMENT, 0)), high_ = (real)(PAIRS_FROM(READ_ELEMENT, VW / 2)); \
  const real X = (real)(low_.even, high_.even), Y = (real)(low_.odd, high_.odd);
#define READ_XYZ(array, index, X, Y, Z)                                                                  \
  const real row_0_ = (real)(FOURS_FROM(READ_ELEMENT, 0)), row_1_ = (real)(FOURS_FROM(READ_ELEMENT, 1)); \
  const real row_2_ = (real)(FOURS_FROM(READ_ELEMENT, 2)), row_3_ = (real)(FOURS_FROM(READ_ELEMENT, 3)); \
  const real low_01_ = LOW_OF(row_0_, row_1_), low_23_ = LOW_OF(row_2_, row_3_);                         \
  const real high_01_ = HIGH_OF(row_0_, row_1_), high_23_ = HIGH_OF(row_2_, row_3_);                     \
  const real X = FIRST_OF(low_01_, low_23_), Y = LAST_OF(low_01_, low_23_);                              \
  const real Z = FIRST_OF(high_01_, high_23_);
#define READ_FOURS(array, index, X, Y, Z, W) \
  READ_XYZ(array, index, X, Y, Z)            \
  const real W = LAST_OF(high_01_, high_23_);
#endif

#if VW > 1
#if VW == 4
#define FOLD(m, op) ((m).lo op(m).hi)
#define LANE_BITS (int4)(1, 2, 4, 8)
#elif VW == 8
#define FOLD(m, op) (((m).lo op(m).hi).lo op((m).lo op(m).hi).hi)
#define LANE_BITS (int8)(1, 2, 4, 8, 16, 32, 64, 128)
#else
#define FOLD_(half, op) ((half.lo op half.hi).lo op(half.lo op half.hi).hi)
#define FOLD(m, op) FOLD_(((m).lo op(m).hi), op)
#define LANE_BITS (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768)
#endif
SHARED uint lanes_of(mask m) {
  const int2 bits = FOLD(m & LANE_BITS, |);
  return (uint)(bits.x | bits.y);
}
SHARED int mask_all(mask m) {
  const int2 both = FOLD(m, &);
  return (both.x & both.y) < 0;
}
#endif

typedef long i64;
SHARED real real_splat(float x) { return (real)(x); }
SHARED real real_select(mask m, real a, real b) { return select(b, a, m); }
SHARED real real_sqrt(real x) { return sqrt(x); }
#if VW == 1
SHARED real real_rsqrt(real x) { return rsqrt(x); }
#else
// On a CPU a root and a quotient, which keep one slow unit busy. Instead: halving the exponent gives 3.4 %, one step of
// fifth order (minimax) 1e-7, of normal numbers. 0 gives a large number.
SHARED real real_rsqrt(real x) {
  const real y = as_real(0x5f374800 - (as_mask(x) >> 1)), h = 1.0f - x * y * y;
  return y + y * h * (0.49999834f + h * (0.37499798f + h * (0.31393342f + h * 0.27487161f)));
}
#endif
SHARED real real_min(real a, real b) { return fmin(a, b); }
SHARED real real_max(real a, real b) { return fmax(a, b); }
SHARED real real_abs(real x) { return fabs(x); }
// exp(x) = 2^n + 2^n (exp(r) - 1), x = n ln 2 + r, for x in [-87, 87]: what is added, and 2^n. The built-in functions
// are scalar on some CPU drivers, and prepared for what never comes. 1.5 x 2^23 makes the addition round to integers,
// and the 127 leaves n's exponent bits in the sum's lowest ones. The polynomial is off by 3e-9 (minimax).
SHARED real exp_of_remainder(real x, real* power) {
  const real shifted = x * 1.44269504f + 12583039.0f, n = shifted - 12583039.0f;
  const real r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
  *power = as_real(as_mask(shifted) << 23);
  return *power * (r + r * r * (0.5f + r * (0.16666519f + r * (0.04166621f + r * (8.36889e-3f + r * 1.39505e-3f)))));
}
SHARED real real_exp(real x) {
  real power;
  const real rest = exp_of_remainder(x, &power);
  return rest + power;
}
SHARED real real_expm1(real x) {  // nothing cancels
  real power;
  const real rest = exp_of_remainder(x, &power);
  return rest + (power - 1.0f);
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

#ifndef __cplusplus
// Where results steer control flow they have to be the same in every pass and on every device, so that products and
// sums are fused only where it is said.
#pragma OPENCL FP_CONTRACT OFF
#endif

KERNEL_HEADER_END

#endif
