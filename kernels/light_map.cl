// Pass 1: the surface as each light sees it, and a pyramid of heights that finds the lit place nearest to a point.
//
// All lies in the light's own frame: x along the map's right, y along its down, z towards the light, in units of the
// positions. A texel is a float4: height at the sample (UNLIT where nothing is), its slope along x and y, and the
// shading normal, bent towards the light where it must be, as two signed 16-bit fractions x and y in the bits of w.
#ifndef PARIAN_LIGHT_MAP_CL
#define PARIAN_LIGHT_MAP_CL
#include "surface.cl"

#define UNLIT -8.0f
#define CLOSE_ENOUGH 0.7f  // squared distance, as a part of the nearest found, that isn't worth a search

// VW texels to a work-item.
__kernel void light_map_resolve(const View view, const Window window, __global const uint* restrict ids,
                                __global const float4* restrict positions, __global const uint* restrict triangles,
                                __global const float* restrict normals, const uint first,
                                __global float4* restrict map) {
  const uint i = (uint)get_global_id(0) * VW, n = window.width * window.height;
  if (i >= n) return;
  mask empty;
  const ureal id = triangles_at(ids, i, n, &empty);
  real height = real_splat(UNLIT), slope_x = real_splat(0.0f), slope_y = slope_x;
  mask normal = (mask)(0);  // an integer until it's stored: as a float it may be a NaN that some devices quiet
  if (!mask_all(empty)) {
    real px, py;
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    const real3 n_g = to_frame_wide(view, s.n_g);
    const real steepness = -1.0f / real_max(n_g.z, real_splat(MIN_COSINE_OF_REBUILD));
    const real3 towards = real3_make(real_splat(0.0f), real_splat(0.0f), real_splat(1.0f));
    const real3 n_s = bend_normal(to_frame_wide(view, s.n_s), towards);
    const mask n_x = round_to_mask(n_s.x * 32767.0f) & 0xffff, n_y = round_to_mask(n_s.y * 32767.0f);
    height = real_select(empty, height, unfused_dot(real3_sub(s.x, uniform3(view.origin)), uniform3(view.back)));
    slope_x = real_select(empty, slope_x, n_g.x * steepness);
    slope_y = real_select(empty, slope_y, n_g.y * steepness);
    normal = select(n_x | n_y << 16, normal, empty);
  }
  for (uint k = 0; k < VW && i + k < n; ++k)
    map[first + i + k] =
        (float4)(ELEMENT(height, k), ELEMENT(slope_x, k), ELEMENT(slope_y, k), as_float(INDEX(normal, k)));
}

// A texel's shading normal, unpacked.
static real3 shading_normal(mask packed) {
  const real n_x = convert_real((packed << 16) >> 16) * (1.0f / 32767.0f);
  const real n_y = convert_real(packed >> 16) * (1.0f / 32767.0f);
  return real3_make(n_x, n_y, real_sqrt(real_max(1.0f - n_x * n_x - n_y * n_y, real_splat(1e-4f))));
}

// Level 0 of the height pyramid: (lowest, highest) of each texel's plane within half a texel; an empty node has
// lowest > highest.
__kernel void light_map_extent(const uint n_texels, const float scale, __global const float4* restrict map,
                               const uint first, __global float2* restrict extent, const uint first_node) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_texels) return;
  const float4 texel = map[first + i];
  const float rise = 0.5f * (fabs(texel.y) + fabs(texel.z)) / scale;
  extent[first_node + i] = texel.x > UNLIT ? (float2)(texel.x - rise, texel.x + rise) : (float2)(FLT_MAX, -FLT_MAX);
}

// The next level from the one below; sizes halve upwards, and children beyond the border are empty.
__kernel void light_map_extent_up(const uint size, const uint from, const uint to, __global float2* extent) {
  const uint i = (uint)get_global_id(0), half_size = (size + 1) / 2;
  if (i >= half_size * half_size) return;
  const uint x = 2 * (i % half_size), y = 2 * (i / half_size);
  float2 e = (float2)(FLT_MAX, -FLT_MAX);
  for (uint c = 0; c < 4; ++c) {
    const uint cx = x + (c & 1), cy = y + (c >> 1);
    if (cx >= size || cy >= size) continue;
    const float2 child = extent[from + cy * size + cx];
    e = (float2)(fmin(e.x, child.x), fmax(e.y, child.y));
  }
  extent[to + i] = e;
}

#if ESTIMATOR == 0
// From t to the nearest point of a texel's piece of the plane z = slope . (x, y), half a texel to each side: the
// plane's foot if that lies on the piece, else the nearest point of the side through which one leaves for the foot.
static float3 to_piece(float3 t, float2 slope) {
  const float2 foot = t.xy + slope * ((t.z - dot(slope, t.xy)) / (1.0f + dot(slope, slope)));
  const float2 inside = clamp(foot, -0.5f, 0.5f);
  const float2 other = clamp((t.xy + slope * (t.z - slope.yx * inside.yx)) / (1.0f + slope * slope), -0.5f, 0.5f);
  const float3 a = (float3)(inside.x, other.y, slope.x * inside.x + slope.y * other.y) - t;
  const float3 b = (float3)(other.x, inside.y, slope.x * other.x + slope.y * inside.y) - t;
  return dot(a, a) < dot(b, b) ? a : b;
}

// The lowest and highest of a node of the height pyramid; beyond the border, as where nothing is lit, lowest > highest.
static float2 node_extent(__global const float2* level, uint size, uint x, uint y) {
  return x < size && y < size ? level[y * size + x] : (float2)(FLT_MAX, -FLT_MAX);
}

// Squares of the distances from t to the boxes of a node's four children in the height pyramid, in units of texels;
// FLT_MAX where there is none.
static float4 child_distances(float3 t, __constant Light* light, __global const float2* extent,
                              __constant uint* level_first, uint level, uint x, uint y) {
  const uint below = level - 1, size = (light->view.width + (1u << below) - 1) >> below;
  const float side = (float)(1u << below), scale = light->view.scale;
  __global const float2* first = extent + light->extent + level_first[below];
  const float2 z0 = node_extent(first, size, 2 * x, 2 * y), z1 = node_extent(first, size, 2 * x + 1, 2 * y);
  const float2 z2 = node_extent(first, size, 2 * x, 2 * y + 1), z3 = node_extent(first, size, 2 * x + 1, 2 * y + 1);
  const float4 bottom = (float4)(z0.x, z1.x, z2.x, z3.x), top = (float4)(z0.y, z1.y, z2.y, z3.y);
  const float4 left = ((float)(2 * x) + (float4)(0.0f, 1.0f, 0.0f, 1.0f)) * side;
  const float4 front = ((float)(2 * y) + (float4)(0.0f, 0.0f, 1.0f, 1.0f)) * side;
  const float4 away_x = fmax(fmax(left - t.x, t.x - left - side), 0.0f);
  const float4 away_y = fmax(fmax(front - t.y, t.y - front - side), 0.0f);
  const float4 away_z = fmax(fmax(bottom * scale - t.z, t.z - top * scale), 0.0f);
  return select((float4)(FLT_MAX), away_x * away_x + away_y * away_y + away_z * away_z, bottom <= top);
}

// Of four distances the least that comes after (d, child), equal ones in order: (distance, child); the distance is
// FLT_MAX if none is.
static float2 next_child(float4 distances, float d, int child) {
  const int4 number = (int4)(0, 1, 2, 3);
  const float4 left = select((float4)(FLT_MAX), distances, (distances > d) | ((distances == d) & (number > child)));
  const float least = fmin(fmin(left.x, left.y), fmin(left.z, left.w));
  const float found = left.x == least ? 0.0f : left.y == least ? 1.0f : left.z == least ? 2.0f : 3.0f;
  return (float2)(least, found);
}

// The lit surface that is nearest to a point: the square of the distance, FLT_MAX where nothing is lit, its place in
// the light's plane, and its texel.
typedef struct {
  float distance_sq;
  float2 place;
  uint texel;
} Lit;

// Takes a texel's piece for the nearest one if it is nearer to t than that.
static void nearer_piece(float3 t, __constant Light* light, __global const float4* map, uint x, uint y, Lit* nearest) {
  const uint i = y * light->view.width + x;
  const float4 piece = map[light->map + i];
  const float3 away = to_piece(t - (float3)((float)x + 0.5f, (float)y + 0.5f, piece.x * light->view.scale), piece.yz);
  if (!(piece.x > UNLIT && dot(away, away) < nearest->distance_sq)) return;
  nearest->distance_sq = dot(away, away);
  nearest->place = t.xy + away.xy;
  nearest->texel = i;
}

// The lit surface that is nearest to t, all in units of texels, with texel i's piece over [i, i + 1]. Depth-first
// through the height pyramid, nearest child first, and without a stack, which a GPU would keep in memory: on the way
// up, the order of the children is found again. What is lit right above or below t tells in which node to look. Through
// a pointer: of a returned struct clang makes what Oclgrind 21.10 can't run.
static void nearest_lit(float3 t, __constant Light* light, __global const float4* map, __global const float2* extent,
                        __constant uint* level_first, uint levels, Lit* nearest) {
  const float last = (float)light->view.width - 1.0f;
  nearest->distance_sq = FLT_MAX;
  nearest->place = t.xy;
  nearest->texel = 0;
  uint top = levels - 1, x = 0, y = 0;
  if (t.x >= 0.0f && t.y >= 0.0f && t.x < last + 1.0f && t.y < last + 1.0f) {
    nearer_piece(t, light, map, convert_uint(t.x), convert_uint(t.y), nearest);
    const float reach = fmin(sqrt(nearest->distance_sq * CLOSE_ENOUGH), 2.0f * last);
    const uint2 low = convert_uint2(clamp(t.xy - reach, 0.0f, last)),
                high = convert_uint2(clamp(t.xy + reach, 0.0f, last));
    const uint differ = (low.x ^ high.x) | (low.y ^ high.y);
    top = min(32 - clz(differ), top);
    x = low.x >> top;
    y = low.y >> top;
    if (top == 0) return;
  }
  for (uint level = top;;) {
    float2 next = (float2)(FLT_MAX, 0.0f);
    if (level > 0)
      next = next_child(child_distances(t, light, extent, level_first, level, x, y), -1.0f, 0);
    else
      nearer_piece(t, light, map, x, y, nearest);
    while (next.x >= nearest->distance_sq * CLOSE_ENOUGH) {
      if (level == top) return;
      const int own = (int)((x & 1u) | (y & 1u) << 1);
      ++level;
      x >>= 1;
      y >>= 1;
      const float4 distances = child_distances(t, light, extent, level_first, level, x, y);
      const float2 row = own < 2 ? distances.xy : distances.zw;
      next = next_child(distances, (own & 1) == 0 ? row.x : row.y, own);
    }
    --level;
    x = 2 * x + ((uint)next.y & 1u);
    y = 2 * y + ((uint)next.y >> 1);
  }
}
#endif

#endif
