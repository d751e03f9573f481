// Guides of samples: for tiles of layer texels that lie away from what is lit, which of the lit places give them light.
//
// A map's lit texels are listed along a Hilbert curve through GUIDE_SIDE^3 cubes of space, so that ranges of the list
// are compact in space, however deep the surface is as the light sees it. A guide gives ranges of the list, or where
// one gives much light its PARTS_OF_RANGE parts, strips in proportion to what they give: each is of one part, or of
// whole ones, and a sample lies anywhere in one of them. In memory: where each strip begins and the last one ends, in
// units of which a texel of the list has 2^unit_bits; how many parts a texel is; and each part's density, as bytes.
// Where there is no guide the end is 0.
//
// A texel's sample depends on what every other gives. So that all devices make the same guides, nothing in here is
// fused, quotients are products with reciprocals, and nothing else than positions and heights goes in.
#ifndef PARIAN_GUIDE_CL
#define PARIAN_GUIDE_CL
#include "guide_list.cl"

#define LEAST_SHARE 0x1p-24f  // of the light of a channel that counts
#define PARTED_SHARE 0x1p-8f  // ranges that may give more are parted
#define MEAN_RADII 0.5f       // by so many of its radii a place lies nearer than its middle
#define MOST_RADII 3.0f       // at most: where the curve jumps, few texels may lie far from the others
#define GUIDED_FROM 3.0f      // points whose h is more than so many times h_min have guides
#define END_OF_STRIPS GUIDE_STRIPS
#define PARTS_PER_TEXEL (GUIDE_STRIPS + 1u)
#define CODES_OF_PARTS (GUIDE_STRIPS + 2u)
#define WHOLE_RANGE 0x80u  // beside a share, while a guide is made

#if ESTIMATOR == 0
// Where part number `part` of a list of n begins: part k n / GUIDE_PARTS, rounded. Place i is of part
// (i + 1/2) GUIDE_PARTS / n, rounded down.
static uint part_begins(uint part, uint n) {
  return convert_uint(((ulong)part * n + (GUIDE_PARTS / 2 - 1)) / GUIDE_PARTS);
}

// A place, from sums over its texels: (middle, how many they are), and the root mean square of the distance from there.
// What light they let in isn't asked: it's little where light grazes alone, and normals differ between devices.
static void place_of(float4 sum, float squares, __global float4* place) {
  const float per_texel = sum.w > 0.0f ? 1.0f / sum.w : 0.0f;
  const float3 middle = sum.xyz * per_texel;
  const float spread = squares * per_texel - inner(middle, middle);
  place[0] = (float4)(middle, sum.w);
  place[1] = (float4)(sqrt(fmax(spread, 0.0f)), 0.0f, 0.0f, 0.0f);
}

// The ranges of a list, and after them their parts.
__kernel void guide_places(const View view, __global const float4* restrict map, const uint first, const uint number,
                           __global const uint* restrict lists, __global float4* restrict places) {
  const uint range = (uint)get_global_id(0);
  __global const uint* lit = lists + number * LIST_SIZE(view.width * view.width);
  const uint n = lit[0];
  const float pixel = 1.0f / view.scale;
  if (range >= GUIDE_RANGES) return;
  float4 sum = (float4)(0.0f);
  float squares = 0.0f;
  for (uint part = range * PARTS_OF_RANGE; part < (range + 1) * PARTS_OF_RANGE; ++part) {
    float4 of_part = (float4)(0.0f);
    float squares_of_part = 0.0f;
    for (uint i = part_begins(part, n); i < part_begins(part + 1, n); ++i) {
      const uint at = lit[LISTED + i], column = at & 0xffffu, row = at >> 16;
      const float4 texel = map[first + row * view.width + column];
      const float3 x = (float3)(((float)column + 0.5f - view.centre_x) * pixel,
                                ((float)row + 0.5f - view.centre_y) * pixel, texel.x);
      of_part += (float4)(x, 1.0f);
      squares_of_part += inner(x, x);
    }
    sum += of_part;
    squares += squares_of_part;
    place_of(of_part, squares_of_part, places + 2 * (GUIDE_RANGES + part));
  }
  place_of(sum, squares, places + 2 * range);
}

// exp(-t) within 6 %, t >= 0: a float's bits are about its logarithm.
static real rough_attenuation(real t) {
  return as_real(0x3f7a0000 - convert_mask(real_min(t, real_splat(80.0f)) * 12102203.0f));
}

// Of VW places, how far their light comes to p in the light's frame: from their middle, less so many radii; and how
// much it is.
static real distance_of_places(__global const float4* restrict places, float3 p, float radii, real* light) {
  const ureal number = 2 * ((ureal)(0u) + SIDE_BY_SIDE);
#define READ_ELEMENT(k) places[INDEX(number, k)]
  READ_FOURS(places, number, x, y, z, w)
#undef READ_ELEMENT
#define RADIUS(k) places[INDEX(number, k) + 1].x
  const real radius = (real)(OF_EACH(RADIUS));
#undef RADIUS
  *light = w;
  const real3 away = real3_make(x - p.x, y - p.y, z - p.z);
  const real d2 = unfused_dot(away, away) + 1e-12f;
  return real_max(real_sqrt(d2) - radii * radius, (0.25f / radii) * real_sqrt(d2 + radius * radius));
}

// About what each of VW places gives of all the light at p, summed over channels: `per_light` is 1 over all in each
// channel, or 0. With `sum`, what they give is added to that instead, one after the other. Both are less by a common
// factor: `closest` is the distance of the nearest.
static real share_of_places(__global const float4* restrict places, float3 p, float radii, float closest,
                            __constant Medium* media, const float* per_light, float* sum) {
  real light, share = real_splat(0.0f);
  const real d = distance_of_places(places, p, radii, &light), beyond = real_max(d - closest, real_splat(0.0f));
  UNROLL for (uint m = 0; m < MEDIA; ++m) {
    const float sigma_tr = media[m].sigma_tr * media[m].sigma_t_prime;
    const real given = light * rough_attenuation(sigma_tr * beyond) * (1.0f / (d * d));
    if (sum)
      for (uint k = 0; k < VW; ++k) sum[m] += ELEMENT(given, k);
    else
      share += given * per_light[m];
  }
  return share;
}

// Shares rounded to 1, 1.5, 2, 3, 4, 6, ... times a power of two: should devices round differently, it hardly shows. At
// most 1, as ranges far away may look darker than their parts are. As seven bits, 0 below LEAST_SHARE.
#define SHARE_BITS 22
#define LEAST_CODE (as_uint(LEAST_SHARE) >> SHARE_BITS)
static mask share_codes(real share) {
  const mask code = ((as_mask(real_min(share, real_splat(1.0f))) + 0x00200000) >> SHARE_BITS) - ((int)LEAST_CODE - 1);
  return select((mask)(0), code, code > 0);
}

static float share_of_code(uint code) { return code ? as_float((code + LEAST_CODE - 1u) << SHARE_BITS) : 0.0f; }

// From which distance of the centre's h on points have guides.
static float guided_from(float h_min) { return GUIDED_FROM * h_min; }

// Where tiles lie that have a guide for one light, those with a needed texel that is far enough from what is lit: the
// covered texel nearest to the tile's middle stands for all, whatever is needed. (x, 1), or (x, 0) for the others.
__kernel void guide_stands(const uint l, const float h_min, __constant View* views, const uint n_tiles,
                           __global const uint* restrict ids, __global const float4* restrict positions,
                           __global const uint* restrict triangles, __global const float* restrict normals,
                           __global const uint* restrict n_needed, __global const uint* restrict slots,
                           __global const float4* restrict centres, __global float4* restrict stands) {
  const uint tile = (uint)get_global_id(0);
  if (tile >= n_tiles) return;
  const uint width = views[0].width, height = views[0].height, columns = (width + GUIDE_TILE - 1) / GUIDE_TILE;
  const uint rows = (height + GUIDE_TILE - 1) / GUIDE_TILE, layer = tile / (columns * rows);
  const uint x0 = tile % columns * GUIDE_TILE, y0 = tile / columns % rows * GUIDE_TILE;
  __global const float4* of_points = centres + l * n_needed[0];
  stands[l * n_tiles + tile] = (float4)(0.0f);
  uint far = 0, stand = 0, least = 0xffffffffu;
  for (uint y = y0; y < min(y0 + GUIDE_TILE, height); ++y)
    for (uint x = x0; x < min(x0 + GUIDE_TILE, width); ++x) {
      const uint texel = (layer * height + y) * width + x, slot = slots[texel];
      if (ids[texel] == NO_TRIANGLE) continue;
      if (slot != NO_SLOT) far |= of_points[slot].z > guided_from(h_min);
      const int d_x = (int)(2 * (x - x0) + 1) - (int)GUIDE_TILE, d_y = (int)(2 * (y - y0) + 1) - (int)GUIDE_TILE;
      if ((uint)(d_x * d_x + d_y * d_y) >= least) continue;
      least = (uint)(d_x * d_x + d_y * d_y);
      stand = texel;
    }
  if (!far) return;
  const float stand_x = (float)(stand % width) + 0.5f, stand_y = (float)(stand / width % height) + 0.5f;
  const Point point = point_at(views[layer], stand_x, stand_y, ids[stand], positions, triangles, normals);
  stands[l * n_tiles + tile] = (float4)(point.x, 1.0f);
}

// Bytes of a guide's parts, four to a word: not every driver stores single bytes.
static uint byte_of_part(__global const uint* guide, uint part) {
  return guide[CODES_OF_PARTS + part / 4] >> part % 4 * 8 & 0xffu;
}

// Which strips have been given out, how much light lies before the next one, and from which part of the list on.
typedef struct {
  uint strip, part;
  float given;
} Filled;

// Gives the parts up to `end` so many strips of equal length.
static void fill_strips(__global uint* guide, uint n, uint bits, uint end, uint strips, Filled* f) {
  const uint begins = part_begins(f->part, n), texels = part_begins(end, n) - begins;
  const float length = (float)(texels << bits) * (1.0f / (float)strips);
  for (uint k = 0; k < strips; ++k) guide[f->strip + k] = (begins << bits) + convert_uint((float)k * length);
  f->strip += strips;
  f->part = end;
}

// Some parts that give `share`. Those that give too little for a strip wait for the next ones.
static void add_parts(__global uint* guide, uint n, uint bits, float strips_of_light, uint begin, uint end, float share,
                      Filled* f) {
  f->given += share;
  const uint strips = min(convert_uint(f->given * strips_of_light + 0.5f), GUIDE_STRIPS);
  if (strips > f->strip + 1 && part_begins(f->part, n) < part_begins(begin, n))
    fill_strips(guide, n, bits, begin, 1, f);
  if (strips > f->strip) fill_strips(guide, n, bits, end, strips - f->strip, f);
}

// The guides of one map, of which that of tile 0 and half A begins at `first_guide`.
__kernel void guide_tiles(const View view, const uint number, __global const float4* restrict places,
                          __constant Medium* media, const uint n_tiles, __global const float4* restrict stands,
                          const uint first_guide, __global uint* restrict guides) {
  const uint tile = (uint)get_global_id(0), texels = view.width * view.width;
  if (tile >= n_tiles) return;
  const uint n = guides[number * LIST_SIZE(texels)], bits = unit_bits(texels);
  const float4 stand = stands[number / 2 * n_tiles + tile];
  __global uint* guide = guides + first_guide + (2 * tile + number % 2) * GUIDE_SIZE;
  guide[END_OF_STRIPS] = 0;
  if (!(stand.w > 0.0f)) return;
  const float3 p = to_frame(view, stand.xyz - view.origin.xyz);
  real nearest = real_splat(FLT_MAX), light;
  for (uint r = 0; r < GUIDE_RANGES; r += VW) {
    const real d = distance_of_places(places + 2 * r, p, MEAN_RADII, &light);
    nearest = real_select(light > 0.0f, real_min(nearest, d), nearest);
  }
  float closest = FLT_MAX;
  for (uint k = 0; k < VW; ++k) closest = fmin(closest, ELEMENT(nearest, k));
  float sum[MEDIA], per_light[MEDIA];
  UNROLL for (uint m = 0; m < MEDIA; ++m) sum[m] = 0.0f;
  for (uint r = 0; r < GUIDE_RANGES; r += VW)
    share_of_places(places + 2 * r, p, MEAN_RADII, closest, media, per_light, sum);
  UNROLL for (uint m = 0; m < MEDIA; ++m) {
    // Channels that don't scatter, or repeat another, say nothing: guides are the same if they are left out.
    const int repeats = m > 0 && media[m - 1].scale > 0.0f && media[m].sigma_tr == media[m - 1].sigma_tr &&
                        media[m].sigma_t_prime == media[m - 1].sigma_t_prime;
    per_light[m] = sum[m] > 1e-30f && media[m].scale > 0.0f && !repeats ? 1.0f / sum[m] : 0.0f;
  }
  // How much each range gives, or each of its parts.
  float all = 0.0f;
  for (uint r = 0; r < GUIDE_RANGES; r += VW) {
    const mask of_ranges = share_codes(share_of_places(places + 2 * r, p, MEAN_RADII, closest, media, per_light, 0));
    const mask at_most = share_codes(share_of_places(places + 2 * r, p, MOST_RADII, closest, media, per_light, 0));
    for (uint k = 0; k < VW; ++k) {
      const uint first = (r + k) * PARTS_OF_RANGE;
      if (share_of_code(INDEX(at_most, k)) <= PARTED_SHARE) {
        guide[CODES_OF_PARTS + first / 4] = INDEX(of_ranges, k) | WHOLE_RANGE;
        all += share_of_code(INDEX(of_ranges, k));
        continue;
      }
      uint word = 0;
      for (uint part = first; part < first + PARTS_OF_RANGE; part += VW) {
        const mask of_parts = share_codes(
            share_of_places(places + 2 * (GUIDE_RANGES + part), p, MEAN_RADII, closest, media, per_light, 0));
        for (uint i = 0; i < VW; ++i) {
          word |= INDEX(of_parts, i) << (part + i) % 4 * 8;
          if ((part + i) % 4 == 3) {
            guide[CODES_OF_PARTS + (part + i) / 4] = word;
            word = 0;
          }
          all += share_of_code(INDEX(of_parts, i));
        }
      }
    }
  }
  // Where each strip begins; what is left gives nothing.
  Filled filled;
  filled.strip = filled.part = 0;
  filled.given = 0.0f;
  for (uint part = 0; part < GUIDE_PARTS && all > 0.0f;) {
    const uint code = byte_of_part(guide, part), end = part + (code & WHOLE_RANGE ? PARTS_OF_RANGE : 1u);
    add_parts(guide, n, bits, (float)GUIDE_STRIPS * (1.0f / all), part, end, share_of_code(code & ~WHOLE_RANGE),
              &filled);
    part = end;
  }
  guide[END_OF_STRIPS] = part_begins(filled.part, n) << bits;
  guide[PARTS_PER_TEXEL] = as_uint((float)GUIDE_PARTS * (1.0f / (float)n));
}

// Densities beside an even one as bytes: three bits of the mantissa and five of the exponent, from 2^-11 on.
#define DENSITY_BITS 20
#define DENSITY_SCALE 0x1p115f

// The density in each part of the guides of one map, in place of what it gives. A kernel of its own, since llvmpipe
// ends loops silently once an item and those beside it have gone round 65535 times.
__kernel void guide_densities(const View view, const uint number, const uint n_tiles, const uint first_guide,
                              __global uint* restrict guides) {
  const uint tile = (uint)get_global_id(0), texels = view.width * view.width;
  if (tile >= n_tiles) return;
  const uint n = guides[number * LIST_SIZE(texels)], bits = unit_bits(texels);
  __global uint* guide = guides + first_guide + (2 * tile + number % 2) * GUIDE_SIZE;
  const uint end = guide[END_OF_STRIPS];
  if (end == 0) return;
  const float even = (float)n * (1.0f / GUIDE_STRIPS) * (float)(1u << bits);
  uint begin_of_strip = guide[0], end_of_strip = guide[1], strip = 0, code = 0, begin = 0;
  for (uint word = 0; word < GUIDE_PARTS / 4; ++word) {
    uint codes = 0;
    for (uint i = 0; i < 4; ++i) {
      while (strip + 1 < GUIDE_STRIPS && end_of_strip <= begin) {
        ++strip;
        begin_of_strip = end_of_strip;
        end_of_strip = guide[strip + 1];
        code = 0;
      }
      if (code == 0) {
        const float density = even * (1.0f / (float)(end_of_strip - begin_of_strip));
        code = clamp(as_uint(density / DENSITY_SCALE) >> DENSITY_BITS, 1u, 255u);
      }
      codes |= (begin < end ? code : 0) << i * 8;
      begin = part_begins(4 * word + i + 1, n) << bits;
    }
    guide[CODES_OF_PARTS + word] = codes;
  }
}

// Moves the samples that are the guide's (`guided` is 1, else 0) to where it has them, by t and v in [0, 1), and sets
// the weights of all: by the balance heuristic (Veach and Guibas 1995), as each sampler takes half of the samples.
// `guide` and `map` are where each lane's half has its guide and its list; its texels have their samples at (sample_x,
// sample_y). The heuristic knows both densities about: the guide's by parts of the list, and that around the nearest
// lit place, at distance h, as rho^-2 exp(-sigma_tr rho) 1.2 / (2 pi G(h)), since rho^-0.1 is near 1.2 wherever an
// object is. What samples count still is exact.
static void guide_samples(__global const uint* guides, ureal guide, ureal map, real parts_per_texel, View view,
                          real sample_x, real sample_y, float4 centre, float sigma_tr, ureal guided, real t, real v,
                          real* x, real* y, real* weight) {
  CONTRACT
  const uint texels = view.width * view.width, bits = unit_bits(texels);
  const float unit = (float)(1u << bits), last = (float)view.width - 1.0f;
  const mask of_guide = guided == 1u;

  const real position = real_min(t * (float)GUIDE_STRIPS, real_splat((float)GUIDE_STRIPS - 1e-3f));
  const real strip = floor(position);
  const ureal at_strip = guide + convert_ureal(strip);
#define READ_ELEMENT(k) guides[INDEX(at_strip, k)]
  const ureal begin = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
#define READ_ELEMENT(k) guides[INDEX(at_strip, k) + 1]
  const ureal end = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
  const real length = real_from_bits(end - begin);
  const ureal place = begin + convert_ureal((position - strip) * length);

  // One look tells which texels the guide's samples are in, and where in the list those of the others are.
  const real own_column = floor(*x * view.scale + view.centre_x - sample_x + 0.5f);
  const real own_row = floor(*y * view.scale + view.centre_y - sample_y + 0.5f);
  const real column = real_min(real_max(own_column, real_splat(0.0f)), real_splat(last));
  const real row = real_min(real_max(own_row, real_splat(0.0f)), real_splat(last));
  const ureal own_texel = RANKED(texels) + (convert_ureal(row) * view.width + convert_ureal(column));
  const ureal at = map + own_texel + guided * (LISTED + (place >> bits) - own_texel);
#define READ_ELEMENT(k) guides[INDEX(at, k)]
  const ureal found = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
  const real guided_x = real_from_bits(found & 0xffffu) + (real_from_bits(place & ((1u << bits) - 1u)) + 0.5f) / unit;
  const real guided_y = real_from_bits(found >> 16) + v;
  *x = real_select(of_guide, (guided_x + sample_x - 0.5f - view.centre_x) / view.scale, *x);
  *y = real_select(of_guide, (guided_y + sample_y - 0.5f - view.centre_y) / view.scale, *y);

  const ureal rank = found + guided * ((place >> bits) - found);
  const ureal part =
      convert_ureal(real_min((real_from_bits(rank) + 0.5f) * parts_per_texel, real_splat((float)GUIDE_PARTS - 1.0f)));
  const ureal at_code = guide + CODES_OF_PARTS + (part >> 2);
#define READ_ELEMENT(k) guides[INDEX(at_code, k)]
  const ureal word = (ureal)(OF_EACH(READ_ELEMENT));
#undef READ_ELEMENT
  const ureal code = word >> ((part & 3u) << 3) & 0xffu;
  const real density = as_real(code << DENSITY_BITS) * (parts_per_texel * (DENSITY_SCALE / GUIDE_PARTS));  // per texel

  const real d_x = *x - centre.x, d_y = *y - centre.y, rho2 = d_x * d_x + d_y * d_y + centre.z * centre.z;
  const real exponent = sigma_tr * (rho2 * real_rsqrt(rho2)) + (centre.w + 1.6556f);  // ln(2 pi / 1.2)
  const real radial = real_exp(-real_min(exponent, real_splat(80.0f)));
  const real both = 2.0f / (radial + density * (view.scale * view.scale) * rho2);  // and rho2 of both
  *weight = both * real_select(of_guide, density * length * (GUIDE_STRIPS / unit) * rho2, *weight * radial);
}
#endif

#endif
