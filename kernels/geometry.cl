// A mesh as it lies in its owner's buffers, read into what the rasteriser takes: positions in object units, triangles
// that are safe to follow, and shading normals of corners. Sums of normals are in whole numbers, so that their order
// doesn't matter.
#include "raster.h"

#define NORMAL_UNIT 0x1p20f       // of summed normals: radians of corners to 1e-6, 2000 of them before they overflow
#define OUTSIDE_SQ 1.0002f        // of the unit sphere, rounding aside
#define SMOOTH_COSINE 0.7660444f  // of 40 degrees; corners more bent than that keep their triangle's normal

// The order of floats as that of whole numbers.
static uint ordered(float x) {
  const uint bits = as_uint(x);
  return bits >> 31 ? ~bits : bits | 0x80000000u;
}

static int is_finite(float3 p) { return all(as_uint3(fabs(p)) < (uint3)(0x7f800000u)); }

// Corners of a triangle in its owner's buffers; false if one doesn't exist or isn't finite.
static int read_corners(uint i, uint n_positions, __global const uint* indices, uint first_index,
                        __global const float* source, uint first, uint stride, float3* corners) {
  const uint3 t = vload3(0, indices + first_index + (size_t)i * 3);
  if (t.x >= n_positions || t.y >= n_positions || t.z >= n_positions) return 0;
  corners[0] = vload3(0, source + first + (size_t)t.x * stride);
  corners[1] = vload3(0, source + first + (size_t)t.y * stride);
  corners[2] = vload3(0, source + first + (size_t)t.z * stride);
  return is_finite(corners[0]) && is_finite(corners[1]) && is_finite(corners[2]);
}

// The largest squared distance of corners from a centre in two parts, times inverse_unit^2; may be infinite.
static float reach_sq(const float3* corners, float4 centre, float4 centre_rest, float inverse_unit) {
  float largest = 0.0f;
  for (int k = 0; k < 3; ++k) {
    const float3 x = (corners[k] - centre.xyz - centre_rest.xyz) * inverse_unit;
    largest = fmax(largest, dot(x, x));
  }
  return largest;
}

// How many triangles have their reach_sq in each range of floats that share exponent and two bits more.
__kernel void geometry_reaches(const uint n_triangles, const uint n_positions, __global const uint* indices,
                               const uint first_index, __global const float* source, const uint first,
                               const uint stride, const float4 centre, const float4 centre_rest,
                               const float inverse_unit, __global uint* counts) {
  const uint i = (uint)get_global_id(0);
  float3 corners[3];
  if (i >= n_triangles || !read_corners(i, n_positions, indices, first_index, source, first, stride, corners)) return;
  atomic_inc(counts + (as_uint(reach_sq(corners, centre, centre_rest, inverse_unit)) >> REACH_SHIFT));
}

// Of triangles whose reach_sq is at most `limit`: the box, least and largest x, y, z as ordered(), and then the bits of
// the largest reach_sq from another centre. Each work-item takes every so-many-th triangle.
__kernel void geometry_bounds(const uint n_triangles, const uint n_positions, __global const uint* indices,
                              const uint first_index, __global const float* source, const uint first, const uint stride,
                              const float4 centre, const float4 centre_rest, const float inverse_unit,
                              const float limit, const float4 other, const float4 other_rest, __global uint* bounds) {
  const uint start = (uint)get_global_id(0), step = (uint)get_global_size(0);
  float3 low = (float3)(INFINITY), high = (float3)(-INFINITY);
  float largest = 0.0f;
  for (uint i = start; i < n_triangles; i += step) {
    float3 corners[3];
    if (!read_corners(i, n_positions, indices, first_index, source, first, stride, corners)) continue;
    if (as_uint(reach_sq(corners, centre, centre_rest, inverse_unit)) > as_uint(limit)) continue;
    low = fmin(low, fmin(corners[0], fmin(corners[1], corners[2])));
    high = fmax(high, fmax(corners[0], fmax(corners[1], corners[2])));
    largest = fmax(largest, reach_sq(corners, other, other_rest, inverse_unit));
  }
  atomic_min(bounds, ordered(low.x));
  atomic_min(bounds + 1, ordered(low.y));
  atomic_min(bounds + 2, ordered(low.z));
  atomic_max(bounds + 3, ordered(high.x));
  atomic_max(bounds + 4, ordered(high.y));
  atomic_max(bounds + 5, ordered(high.z));
  atomic_max(bounds + 6, as_uint(largest));
}

// Positions in object units, (x - centre) / radius with the centre in two parts, and w = 1; w = 0 where one lies so far
// outside the sphere that fixed-point coordinates and depths of orthographic views don't reach it, all 0 where one
// isn't finite.
__kernel void geometry_positions(const uint n_positions, __global const float* source, const uint first,
                                 const uint stride, const float4 centre, const float4 centre_rest,
                                 const float inverse_radius, __global float4* restrict positions) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_positions) return;
  const float3 p = vload3(0, source + first + (size_t)i * stride);
  const float3 x = (p - centre.xyz - centre_rest.xyz) * inverse_radius;
  const int inside = as_uint(dot(x, x)) < as_uint(4.0f);  // bits: not a NaN either
  positions[i] = is_finite(p) ? (float4)(x, inside ? 1.0f : 0.0f) : (float4)(0.0f);
}

// Triangles whose corners exist and lie inside; the others become points, which nothing draws. `outside` counts those
// that leave the sphere, and has the bits of the largest squared distance that one reaches.
__kernel void geometry_triangles(const uint n_triangles, const uint n_positions, __global const uint* source,
                                 const uint first, __global const float4* restrict positions,
                                 __global uint* restrict triangles, __global uint* restrict outside) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(0, source + first + (size_t)i * 3);
  int sound = t.x < n_positions && t.y < n_positions && t.z < n_positions;
  if (sound) {
    const float4 a = positions[t.x], b = positions[t.y], c = positions[t.z];
    sound = a.w != 0.0f && b.w != 0.0f && c.w != 0.0f;
    const float3 corners[3] = {a.xyz, b.xyz, c.xyz};
    const float reach = reach_sq(corners, (float4)(0.0f), (float4)(0.0f), 1.0f);
    if (reach > OUTSIDE_SQ) {
      atomic_inc(outside);
      atomic_max(outside + 1, as_uint(reach));
    }
  }
  vstore3(sound ? t : (uint3)(0), i, triangles);
}

static float3 triangle_normal(float3 a, float3 b, float3 c) {  // 0 without area
  const float3 n = cross(b - a, c - a);
  const float area_sq = dot(n, n);
  return area_sq > 1e-30f ? n * rsqrt(area_sq) : (float3)(0.0f);
}

// Adds a corner's normal, weighted by its angle between the edges to `b` and `c`, to its vertex.
static void add_corner(float3 a, float3 b, float3 c, float3 n, __global int* sum) {
  const float3 e1 = b - a, e2 = c - a;
  const float angle = acos(clamp(dot(e1, e2) * rsqrt(fmax(dot(e1, e1) * dot(e2, e2), 1e-30f)), -1.0f, 1.0f));
  const int3 whole = convert_int3_rte(n * (angle * NORMAL_UNIT));
  atomic_add(sum, whole.x);
  atomic_add(sum + 1, whole.y);
  atomic_add(sum + 2, whole.z);
}

__kernel void geometry_normals_add(const uint n_triangles, __global const float4* restrict positions,
                                   __global const uint* restrict triangles, __global int* sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(i, triangles);
  const float3 a = positions[t.x].xyz, b = positions[t.y].xyz, c = positions[t.z].xyz;
  const float3 n = triangle_normal(a, b, c);
  if (dot(n, n) == 0.0f) return;
  add_corner(a, b, c, n, sums + 3 * t.x);
  add_corner(b, c, a, n, sums + 3 * t.y);
  add_corner(c, a, b, n, sums + 3 * t.z);
}

static float3 corner_normal(__global const int* sum, float3 n) {
  const float3 smooth = convert_float3(vload3(0, sum));
  const float length_sq = dot(smooth, smooth);
  return dot(smooth, n) >= SMOOTH_COSINE * sqrt(length_sq) && length_sq > 0.0f ? smooth * rsqrt(length_sq) : n;
}

__kernel void geometry_normals(const uint n_triangles, __global const float4* restrict positions,
                               __global const uint* restrict triangles, __global const int* restrict sums,
                               __global float* restrict normals) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(i, triangles);
  const float3 n = triangle_normal(positions[t.x].xyz, positions[t.y].xyz, positions[t.z].xyz);
  vstore3(corner_normal(sums + 3 * t.x, n), 3 * i, normals);
  vstore3(corner_normal(sums + 3 * t.y, n), 3 * i + 1, normals);
  vstore3(corner_normal(sums + 3 * t.z, n), 3 * i + 2, normals);
}
