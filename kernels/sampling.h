// Where samples lie: endless low-discrepancy sequences, which of them a point has, and a curve through space.
#ifndef PARIAN_SAMPLING_H
#define PARIAN_SAMPLING_H
#include "types.h"

KERNEL_HEADER_BEGIN

// Steps of the R2 sequence, 1/p and 1/p^2 with p^3 = p + 1, in 32-bit fixed point: wraps exactly, forever.
#define R2_STEP_U 3242174889u
#define R2_STEP_V 2447445414u

// An extensible lattice (Hickernell, Hong, L'Ecuyer, Lemieux 2000): sample k is (1, LATTICE_V) times the bits of k in
// reverse order as a fraction, modulo 1, so that the first 2^m are a lattice for every m. Where a function has edges,
// the squared error of a lattice falls as the sum of |k|^-3 over its dual: this one's is at most 1.33 times the least
// that a lattice of as many points could have, for m up to 22.
#define LATTICE_V 9760019u

// The texels of a block of BLOCK^2 share their sequences but for shifts, each another multiple of a ninth of the
// generator: together they make one lattice of nine times as many points, no worse than above. So part of their errors
// cancels where several of them are averaged.
#define BLOCK 3u
#define CLASS_STEP_U 477218588u   // 1 / 9 in 32-bit fixed point
#define CLASS_STEP_V 2386092942u  // LATTICE_V / 9, modulo 1

// The number of texel (x, y) of a film of so many texels, block after block; of film number `film`.
SHARED uint point_number(uint film, uint width, uint height, uint x, uint y) {
  const uint columns = (width + BLOCK - 1) / BLOCK, rows = (height + BLOCK - 1) / BLOCK;
  const uint block = (film * rows + y / BLOCK) * columns + x / BLOCK;
  return (block * BLOCK + y % BLOCK) * BLOCK + x % BLOCK;
}

// Of such a number, or of one with the highest bit set: its block, and which of the block's texels it is of.
SHARED uint block_of_point(uint number) { return (number & 0x7fffffffu) / (BLOCK * BLOCK) | (number & 0x80000000u); }
SHARED uint class_of_point(uint number) { return (number & 0x7fffffffu) % (BLOCK * BLOCK); }

// How much smaller than usual h_min may be where light runs along the surface.
#define LEAST_H_MIN 0.1f

// The number of a cube along a Hilbert curve (Skilling 2004: Programming the Hilbert curve).
SHARED uint cube_number(uint x, uint y, uint z) {
  for (uint bit = GUIDE_SIDE / 2; bit > 1; bit /= 2) {
    const uint below = bit - 1;
    if (x & bit) x ^= below;
    const uint y_swaps = (x ^ y) & below;
    x ^= y & bit ? below : y_swaps;
    y ^= y & bit ? 0 : y_swaps;
    const uint z_swaps = (x ^ z) & below;
    x ^= z & bit ? below : z_swaps;
    z ^= z & bit ? 0 : z_swaps;
  }
  y ^= x;
  z ^= y;
  uint turned = 0;
  for (uint bit = GUIDE_SIDE / 2; bit > 1; bit /= 2)
    if (z & bit) turned ^= bit - 1;
  x ^= turned;
  y ^= turned;
  z ^= turned;
  uint number = 0;
  for (uint bit = GUIDE_SIDE / 2; bit > 0; bit /= 2)
    number = number << 3 | (x & bit ? 4u : 0u) | (y & bit ? 2u : 0u) | (z & bit ? 1u : 0u);
  return number;
}

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
