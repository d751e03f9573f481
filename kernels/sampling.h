// Where samples lie: one endless low-discrepancy sequence per point, and the radial density around the lit surface.
#ifndef PARIAN_SAMPLING_H
#define PARIAN_SAMPLING_H
#include "types.h"

KERNEL_HEADER_BEGIN

// Steps of the R2 sequence, 1/p and 1/p^2 with p^3 = p + 1, in 32-bit fixed point: wraps exactly, forever.
#define R2_STEP_U 3242174889u
#define R2_STEP_V 2447445414u

// How much smaller than usual h_min may be where light runs along the surface.
#define LEAST_H_MIN 0.1f

// Bijective mixing of 32 bits (two rounds of multiply and xor-shift).
SHARED uint hash(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

SHARED uint hash_combine(uint a, uint b) { return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6) + (a >> 2))); }

KERNEL_HEADER_END
#endif
