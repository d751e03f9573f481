// Guides of pass 2's samples: for tiles of layer texels that lie far from what is lit, how much of their light comes
// from where.
//
// A light's map is divided into GUIDE_SIDE^2 blocks, and each block into 16 cells. A guide gives every block that gives
// light, or each such cell of the blocks that give most, a number of equal slots; a sample takes one of them, and lies
// somewhere in its block or cell, so that density is slots per area. In memory: the number of slots in use; of each
// block its number of slots, or PARTED and which of the parted blocks it is; of each cell of these its number of slots;
// and for each slot where it is (slot_at).
#define CELL_SIDE (4u * GUIDE_SIDE)  // cells along a side of the map
#define PARTED 0x80000000u
#define SHARES 0x1p21f                      // units of a share in a channel's light: those of all places fit in 32 bits
#define PARTED_SHARE 0x2000u                // blocks that give more are parted, while there are no more than that
#define BLOCKS_OF_GUIDE 1u                  // where these begin
#define CELLS_OF_GUIDE (1u + GUIDE_BLOCKS)  // and these
#define SLOTS_OF_GUIDE (CELLS_OF_GUIDE + PARTED_BLOCKS * CELLS_OF_BLOCK)
#define MOST_OF_PLACE 255u   // slots that a block or cell may have
#define NO_SLOT 0xffffffffu  // of a texel without values
#define GUIDED_FROM 3.0f     // cells' sides between a point and what is lit, at least

#if ESTIMATOR == 0
// A slot: its block, its cell and whether it is of a cell alone, its rank among the slots of the same place, and these.
static uint slot_at(uint block, uint cell, uint parted, uint rank, uint count) {
  return block | cell << 8 | parted << 12 | rank << 13 | count << 21;
}

// A place of a light's map, from the sum of (column, row, height, 1) over its lit texels and from how many it has: its
// middle in the light's frame, and the part of it that is lit, 0 where nothing is.
static float4 place_of(float4 sum, float texels, float centre_x, float centre_y, float scale) {
  if (sum.w == 0.0f) return (float4)(0.0f);
  const float3 middle = sum.xyz / sum.w;
  return (float4)((middle.x - centre_x) / scale, (middle.y - centre_y) / scale, middle.z, sum.w / texels);
}

// The blocks of one light's map, and then their cells, block after block.
__kernel void guide_places(const uint l, __constant Light* lights, __global const float4* restrict map,
                           __global float4* restrict places) {
  const uint block = (uint)get_global_id(0), width = lights[l].view.width;
  if (block >= GUIDE_BLOCKS) return;
  const float centre_x = lights[l].view.centre_x, centre_y = lights[l].view.centre_y, scale = lights[l].view.scale;
  const float side = (float)width / (float)CELL_SIDE, texels = side * side;
  __global float4* blocks = places + l * PLACES_OF_LIGHT;
  __global float4* cells = blocks + GUIDE_BLOCKS + block * CELLS_OF_BLOCK;
  float4 sum = (float4)(0.0f);
  for (uint cell = 0; cell < CELLS_OF_BLOCK; ++cell) {
    const float x = (float)(block % GUIDE_SIDE * 4 + cell % 4), y = (float)(block / GUIDE_SIDE * 4 + cell / 4);
    const uint x0 = convert_uint(ceil(x * side - 0.5f)), x1 = convert_uint(ceil((x + 1.0f) * side - 0.5f));
    const uint y0 = convert_uint(ceil(y * side - 0.5f)), y1 = convert_uint(ceil((y + 1.0f) * side - 0.5f));
    float4 of_cell = (float4)(0.0f);
    for (uint row = y0; row < y1; ++row)
      for (uint column = x0; column < x1; ++column) {
        const float height = map[lights[l].map + row * width + column].x;
        if (height > UNLIT) of_cell += (float4)((float)column + 0.5f, (float)row + 0.5f, height, 1.0f);
      }
    sum += of_cell;
    cells[cell] = place_of(of_cell, texels, centre_x, centre_y, scale);
  }
  blocks[block] = place_of(sum, texels * CELLS_OF_BLOCK, centre_x, centre_y, scale);
}

// Of VW places, about what each gives of all the light at p in the light's frame, summed over channels: `per_light` is
// 1 over all in each channel, or 0. With `sum`, what they give is added to that instead. Both are less by a common
// factor: `closest` is about the distance of the nearest.
static real share_of_places(__global const float4* restrict places, float3 p, float closest, float side,
                            __constant Medium* media, const float* per_light, real* sum) {
  CONTRACT
  const ureal number = (ureal)(0u) + SIDE_BY_SIDE;
#define READ_ELEMENT(k) places[INDEX(number, k)]
  READ_FOURS(places, number, x, y, z, lit)
#undef READ_ELEMENT
  const real3 away = real3_make(x - p.x, y - p.y, z - p.z);
  const real d2 = real3_dot(away, away) + 0.1f * side * side,
             beyond = real_max(real_sqrt(d2) - closest, real_splat(0.0f));
  real share = real_splat(0.0f);
  UNROLL for (uint m = 0; m < MEDIA; ++m) {
    const float sigma_tr = media[m].sigma_tr * media[m].sigma_t_prime;
    const real light = lit * side * side * attenuation(sigma_tr * beyond) / d2;
    if (sum)
      sum[m] += light;
    else
      share += light * per_light[m];
  }
  return share;
}

static float sum_of_lanes(real v) {
  float sum = 0.0f;
  for (uint k = 0; k < VW; ++k) sum += ELEMENT(v, k);
  return sum;
}

// Shares as integers, rounded to 1, 1.5, 2, 3, 4, 6, ...: what devices round differently hardly ever shows, and from
// here on all of them count alike. At most 1, as blocks far away may look darker than their cells are.
static ureal rounded_shares(real share) {
  const mask two_bits = (as_mask(real_min(share, real_splat(1.0f))) + 0x00200000) & 0x7fc00000;
  return convert_ureal(as_real(two_bits) * SHARES);
}

// From which distance of the centre's h on a point is far from what is lit: in cells, and beside how far light spreads.
static float guided_from(uint width, float scale, float h_min) {
  return fmax(GUIDED_FROM * (float)width / ((float)CELL_SIDE * scale), 2.0f * h_min);
}

// The guides of one light, for the tiles of which a needed texel lies far enough from what is lit. The covered texel
// that is nearest to the tile's middle stands for all: whatever is needed, guides are the same.
__kernel void guide_tiles(const uint l, __constant Light* lights, __global const float4* restrict places,
                          __constant Medium* media, const float h_min, __constant View* views, const uint n_tiles,
                          __global const uint* restrict ids, __global const float4* restrict positions,
                          __global const uint* restrict triangles, __global const float* restrict normals,
                          __global const uint* restrict n_needed, __global const uint* restrict slots,
                          __global const float4* restrict centres, __global uint* restrict guides) {
  const uint tile = (uint)get_global_id(0);
  if (tile >= n_tiles) return;
  const uint width = views[0].width, height = views[0].height, columns = (width + GUIDE_TILE - 1) / GUIDE_TILE;
  const uint rows = (height + GUIDE_TILE - 1) / GUIDE_TILE, layer = tile / (columns * rows);
  const uint x0 = tile % columns * GUIDE_TILE, y0 = tile / columns % rows * GUIDE_TILE;
  const float from = guided_from(lights[l].view.width, lights[l].view.scale, h_min);
  __global const float4* of_points = centres + l * n_needed[0];
  __global uint* guide = guides + (l * n_tiles + tile) * GUIDE_SIZE;
  guide[0] = 0;
  uint far = 0, stands = 0, least = 0xffffffffu;
  for (uint y = y0; y < min(y0 + GUIDE_TILE, height); ++y)
    for (uint x = x0; x < min(x0 + GUIDE_TILE, width); ++x) {
      const uint texel = (layer * height + y) * width + x, slot = slots[texel];
      if (ids[texel] == NO_TRIANGLE) continue;
      if (slot != NO_SLOT) far |= of_points[slot].z > from;
      const int d_x = (int)(2 * (x - x0) + 1) - (int)GUIDE_TILE, d_y = (int)(2 * (y - y0) + 1) - (int)GUIDE_TILE;
      if ((uint)(d_x * d_x + d_y * d_y) >= least) continue;
      least = (uint)(d_x * d_x + d_y * d_y);
      stands = texel;
    }
  if (!far) return;
  const float stands_x = (float)(stands % width) + 0.5f, stands_y = (float)(stands / width % height) + 0.5f;
  const Point point = point_at(views[layer], stands_x, stands_y, ids[stands], positions, triangles, normals);
  const float3 p = to_frame(lights[l].view, point.x - lights[l].view.origin.xyz);
  const float block_side = (float)lights[l].view.width / (float)GUIDE_SIDE / lights[l].view.scale;
  const float cell_side = 0.25f * block_side;
  __global const float4* blocks = places + l * PLACES_OF_LIGHT;
  float closest = FLT_MAX;
  for (uint b = 0; b < GUIDE_BLOCKS; ++b)
    if (blocks[b].w > 0.0f) closest = fmin(closest, length(blocks[b].xyz - p));

  real sum[MEDIA];
  float per_light[MEDIA];
  UNROLL for (uint m = 0; m < MEDIA; ++m) sum[m] = real_splat(0.0f);
  for (uint b = 0; b < GUIDE_BLOCKS; b += VW)
    share_of_places(blocks + b, p, closest, block_side, media, per_light, sum);
  UNROLL for (uint m = 0; m < MEDIA; ++m) {
    const float all = sum_of_lanes(sum[m]);
    // Channels that don't scatter, or repeat another, say nothing: guides are the same if they are left out.
    const int repeats = m > 0 && media[m - 1].scale > 0.0f && media[m].sigma_tr == media[m - 1].sigma_tr &&
                        media[m].sigma_t_prime == media[m - 1].sigma_t_prime;
    per_light[m] = all > 1e-30f && media[m].scale > 0.0f && !repeats ? 1.0f / all : 0.0f;
  }
  for (uint b = 0; b < GUIDE_BLOCKS; b += VW) {
    const ureal share = rounded_shares(share_of_places(blocks + b, p, closest, block_side, media, per_light, 0));
    for (uint k = 0; k < VW; ++k) guide[BLOCKS_OF_GUIDE + b + k] = INDEX(share, k);
  }

  uint limit = PARTED_SHARE;
  for (uint above = PARTED_BLOCKS + 1; above > PARTED_BLOCKS;) {
    above = 0;
    for (uint b = 0; b < GUIDE_BLOCKS; ++b) above += guide[BLOCKS_OF_GUIDE + b] > limit;
    if (above > PARTED_BLOCKS) limit += limit / 2;
  }

  // How many places there are, and all that they share.
  uint parted = 0, n_places = 0, all = 0;
  for (uint b = 0; b < GUIDE_BLOCKS; ++b) {
    const uint share = guide[BLOCKS_OF_GUIDE + b];
    if (share > limit) {
      guide[BLOCKS_OF_GUIDE + b] = PARTED | parted;
      for (uint c = 0; c < CELLS_OF_BLOCK; c += VW) {
        __global const float4* cells = blocks + GUIDE_BLOCKS + b * CELLS_OF_BLOCK + c;
        const ureal shares = rounded_shares(share_of_places(cells, p, closest, cell_side, media, per_light, 0));
        for (uint k = 0; k < VW; ++k) {
          const uint of_cell = INDEX(shares, k);
          guide[CELLS_OF_GUIDE + parted * CELLS_OF_BLOCK + c + k] = of_cell;
          all += of_cell;
          n_places += of_cell > 0;
        }
      }
      ++parted;
    } else {
      all += share;
      n_places += share > 0;
    }
  }
  // From shares to slots, at least one for each place that has any.
  uint used = 0, seen = 0, shared = 0, end = 0;
  for (uint b = 0; b < GUIDE_BLOCKS; ++b) {
    const uint entry = guide[BLOCKS_OF_GUIDE + b], of_cells = entry >> 31;
    for (uint c = 0; c < (of_cells ? CELLS_OF_BLOCK : 1u); ++c) {
      const uint at = of_cells ? CELLS_OF_GUIDE + (entry & ~PARTED) * CELLS_OF_BLOCK + c : BLOCKS_OF_GUIDE + b;
      const uint share = guide[at];
      if (share == 0) continue;
      shared += share;
      ++seen;
      const uint start = end;
      end = seen + (uint)((ulong)shared * (GUIDE_SLOTS - n_places) / all);
      const uint count = min(end - start, MOST_OF_PLACE);
      guide[at] = count;
      for (uint k = 0; k < count; ++k) guide[SLOTS_OF_GUIDE + used + k] = slot_at(b, c, of_cells, k, count);
      used += count;
    }
  }
  guide[0] = used;
}

// Moves the samples that are the guide's (`guided` is 1, else 0) to where it has them, by t and v in [0, 1), and sets
// the weights of all: by the balance heuristic (Veach and Guibas 1995), as each sampler takes half of the samples. The
// heuristic knows the density around the nearest lit place, at distance h, about: rho^-2 exp(-sigma_tr rho) 1.2 /
// (2 pi G(h)), since rho^-0.1 is near 1.2 wherever an object is. What samples count still is exact.
static void guide_samples(__global const uint* restrict guide, View view, float4 centre, float sigma_tr, ureal guided,
                          real t, real v, real* x, real* y, real* weight) {
  CONTRACT
  const float used = (float)guide[0], cell = (float)view.width / (float)CELL_SIDE, per_cell = view.scale / cell;
  const float origin_x = view.centre_x / cell, origin_y = view.centre_y / cell, last = (float)CELL_SIDE - 0.5f;
  const mask of_guide = guided == 1u;

  // One look tells where the guide's samples are, and in which blocks the others are.
  const real position = real_min(t * used, real_splat(used - 1e-3f)), whole = floor(position);
  const ureal cell_x = convert_ureal(real_min(real_max(*x * per_cell + origin_x, real_splat(0.0f)), real_splat(last)));
  const ureal cell_y = convert_ureal(real_min(real_max(*y * per_cell + origin_y, real_splat(0.0f)), real_splat(last)));
  const ureal slot = SLOTS_OF_GUIDE + convert_ureal(whole);
  const ureal own_block = BLOCKS_OF_GUIDE + (cell_y >> 2) * GUIDE_SIDE + (cell_x >> 2);
  const ureal at = own_block + guided * (slot - own_block);
#define READ_ELEMENT(k) guide[INDEX(at, k)]
  const ureal found = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
  // What the others make of theirs isn't used, were it 0 / 0.
  const ureal parted = found >> 12 & 1u, block = found & 255u, of_place = found >> 21;
  const real side = real_from_bits(4u - 3u * parted);
  const real along = (real_from_bits(found >> 13 & 255u) + (position - whole)) / real_from_bits(of_place);
  const real column = real_from_bits((block & 15u) * 4u + (found >> 8 & 3u)) + along * side;
  const real row = real_from_bits((block >> 4) * 4u + (found >> 10 & 3u)) + v * side;
  *x = real_select(of_guide, (column - origin_x) / per_cell, *x);
  *y = real_select(of_guide, (row - origin_y) / per_cell, *y);

  const ureal of_cells = found >> 31;
  const ureal own_cell = CELLS_OF_GUIDE + (found & ~PARTED) * CELLS_OF_BLOCK + (cell_y & 3u) * 4u + (cell_x & 3u);
  const ureal at_cell = of_cells * own_cell;
#define READ_ELEMENT(k) guide[INDEX(at_cell, k)]
  const ureal of_cell = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
  const ureal of_guides_block = guided * (of_place * (1u + 15u * parted));
  const ureal of_others = (1u - guided) * (of_cells * (16u * of_cell) + (1u - of_cells) * found);
  const real slots = real_from_bits(of_guides_block + of_others);  // in a block of 16 cells
  const real d_x = *x - centre.x, d_y = *y - centre.y, rho2 = d_x * d_x + d_y * d_y + centre.z * centre.z;
  const real exponent = sigma_tr * (rho2 * real_rsqrt(rho2)) + (centre.w + 1.6556f);  // ln(2 pi / 1.2)
  const real radial = real_exp(-real_min(exponent, real_splat(80.0f)));
  const real both = 2.0f / (radial + slots * (per_cell * per_cell / (16.0f * used)) * rho2);  // and rho2 of both
  *weight = both * real_select(of_guide, rho2, *weight * radial);
}
#endif
