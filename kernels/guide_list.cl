// What is lit of each map, listed along a Hilbert curve through GUIDE_SIDE^3 cubes of space: see guide.cl.
#ifndef PARIAN_GUIDE_LIST_CL
#define PARIAN_GUIDE_LIST_CL
#include "light_map.cl"
#include "sampling.h"

#define NO_RANK 0xffffffffu  // of a texel that isn't lit

#if ESTIMATOR == 0
// The lists come first, map after map: a list's length, the lit texels as (row << 16 | column), and the place in the
// list of each texel. Then come the guides, light after light, tile after tile, of both halves.
#define LISTED 1u
#define RANKED(texels) (1u + (texels))
#define LIST_SIZE(texels) (1u + 2u * (texels))

// The places of a list fit in 31 bits with these below them.
static uint unit_bits(uint texels) { return clz(texels - 1) - 1; }

// Counts the lit texels of each cube of a map, or, once `cubes` says where each begins in the list, lists them: a
// work-item for each column of cubes, square by square, so that what comes one after the other lies close by.
__kernel void guide_list(const View view, __global const float4* restrict map, const uint first, const uint number,
                         const uint listing, __global uint* restrict cubes, __global uint* restrict lists) {
  const uint column = (uint)get_global_id(0), width = view.width, texels = width * width;
  if (column >= GUIDE_SIDE * GUIDE_SIDE) return;
  __global uint* lit = lists + number * LIST_SIZE(texels);
  const uint side = (width + GUIDE_SIDE - 1) / GUIDE_SIDE, squares = (side + 3) / 4;
  const uint cube_x = column % GUIDE_SIDE, cube_y = column / GUIDE_SIDE;
  if (!listing)
    for (uint z = 0; z < GUIDE_SIDE; ++z) cubes[cube_number(cube_x, cube_y, z)] = 0;
  uint last_z = GUIDE_SIDE, cube = 0, next = 0;
  for (uint square = 0; square < squares * squares; ++square) {
    const uint row_of_squares = square / squares, along = square % squares;
    const uint x0 = 4 * (row_of_squares & 1u ? squares - 1 - along : along), y0 = 4 * row_of_squares;
    for (uint i = 0; i < 16; ++i) {
      const uint x = x0 + i % 4, y = y0 + i / 4, u = cube_x * side + x, v = cube_y * side + y;
      if (x >= side || y >= side || u >= width || v >= width) continue;
      const float height = map[first + v * width + u].x;
      uint rank = NO_RANK;
      if (height > UNLIT) {
        const uint z = convert_uint(clamp((height + 1.0f) * (0.5f * GUIDE_SIDE), 0.0f, GUIDE_SIDE - 1.0f));
        if (z != last_z) {
          if (last_z < GUIDE_SIDE) cubes[cube] = next;
          cube = cube_number(cube_x, cube_y, z);
          next = cubes[cube];
          last_z = z;
        }
        rank = next++;
        if (listing) lit[LISTED + rank] = v << 16 | u;
      }
      if (listing) lit[RANKED(texels) + v * width + u] = rank;
    }
  }
  if (last_z < GUIDE_SIDE) cubes[cube] = next;
}

// From how many texels each cube has to where it begins in the list; and the list's length.
__kernel void guide_starts(__global const uint* restrict counts, const uint number, const uint texels,
                           __global uint* restrict cubes, __global uint* restrict lists) {
  const uint item = (uint)get_global_id(0), of_item = GUIDE_CUBES / GUIDE_ITEMS;
  if (item >= GUIDE_ITEMS) return;
  uint sum = 0;
  for (uint i = 0; i < item * of_item; ++i) sum += counts[i];
  for (uint i = item * of_item; i < (item + 1) * of_item; ++i) {
    cubes[i] = sum;
    sum += counts[i];
  }
  if (item + 1 == GUIDE_ITEMS) lists[number * LIST_SIZE(texels)] = sum;
}
#endif

#endif
