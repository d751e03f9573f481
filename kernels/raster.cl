// Triangles to visibility: set-up once per view, then nearest depth, then the lowest triangle id at that depth.
// Used by passes 1, 2 and 4. SLOTS is the number of set-up records per triangle: 1, or 6 where clipping may happen.
#include "raster.h"

static float3 view_coordinates(View view, float3 p) {  // film right, film down, towards the viewer
  const float3 d = p - view.origin.xyz;
  return (float3)(dot(d, view.right.xyz), dot(d, view.down.xyz), dot(d, view.back.xyz));
}

// (film x, film y, nearness) of view coordinates.
static float3 film_coordinates(View view, float3 c) {
  if (view.near_distance > 0.0f) {
    const float q = -1.0f / c.z;
    return (float3)(view.centre_x + view.scale * c.x * q, view.centre_y + view.scale * c.y * q, q);
  }
  return (float3)(view.centre_x + view.scale * c.x, view.centre_y + view.scale * c.y, c.z + 2.0f);
}

// A corner on film: x and y in 1/256 pixels, and the bits of its nearness.
static int4 film_corner(float3 film) {
  return (int4)(convert_int_rte(film.x * (float)SUBPIXELS), convert_int_rte(film.y * (float)SUBPIXELS), as_int(film.z),
                0);
}

static RasterTriangle raster_triangle(uint triangle, int4 corner_a, int4 corner_b, int4 corner_c) {
  RasterTriangle t;
  t.x0 = corner_a.x;
  t.y0 = corner_a.y;
  t.x1 = corner_b.x;
  t.y1 = corner_b.y;
  t.x2 = corner_c.x;
  t.y2 = corner_c.y;
  const float a = as_float(corner_a.z);
  float b = as_float(corner_b.z), c = as_float(corner_c.z);
  const i64 area = edge_function(t.x0, t.y0, t.x1, t.y1, t.x2, t.y2);
  if (area < 0) {  // surfaces are two-sided: the back of a triangle is drawn like its front
    const int x = t.x1, y = t.y1;
    t.x1 = t.x2;
    t.y1 = t.y2;
    t.x2 = x;
    t.y2 = y;
    const float swap = b;
    b = c;
    c = swap;
  }
  const float inverse = 1.0f / (float)(area < 0 ? -area : area);
  const float dx1 = (float)(t.x1 - t.x0), dy1 = (float)(t.y1 - t.y0), dq1 = b - a;
  const float dx2 = (float)(t.x2 - t.x0), dy2 = (float)(t.y2 - t.y0), dq2 = c - a;
  t.q0 = a;
  t.q_x = (dq1 * dy2 - dq2 * dy1) * inverse;
  t.q_y = (dq2 * dx1 - dq1 * dx2) * inverse;
  t.q_min = fmin(a, fmin(b, c));
  t.q_max = fmax(a, fmax(b, c));
  t.triangle = area == 0 ? NO_TRIANGLE : triangle;
  return t;
}

#if SLOTS > 1
// Signed distance of a point in view coordinates to plane `k` of near plane and guard band; inside where >= 0.
static float plane_distance(View view, uint k, float3 c) {
  const float depth = -c.z, guard = (float)GUARD_PIXELS / view.scale;
  if (k == 0) return depth - view.near_distance;
  if (k == 1) return guard * depth - c.x;
  if (k == 2) return guard * depth + c.x;
  if (k == 3) return guard * depth - c.y;
  return guard * depth + c.y;
}

// Where the edge a-b meets a plane. The end that comes first by coordinates counts as first, whichever way the edge
// is walked: two triangles that share an edge get the same bits.
static float3 clip_edge(float3 a, float da, float3 b, float db) {
  const int swap = a.x != b.x ? a.x > b.x : (a.y != b.y ? a.y > b.y : a.z > b.z);
  const float3 p = swap ? b : a, q = swap ? a : b;
  const float dp = swap ? db : da, dq = swap ? da : db;
  return p + (q - p) * (dp / (dp - dq));
}

static void append(float3* polygon, uint* n, float3 corner) {
  UNROLL for (uint v = 0; v < 8; ++v) polygon[v] = v == *n ? corner : polygon[v];
  *n += *n < 8 ? 1 : 0;
}
#endif

__kernel void raster_setup(const View view, __global const float4* restrict positions,
                           __global const uint* restrict triangles, const uint n_triangles,
                           __global RasterTriangle* restrict records) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const float3 a = view_coordinates(view, positions[triangles[3 * i]].xyz);
  const float3 b = view_coordinates(view, positions[triangles[3 * i + 1]].xyz);
  const float3 c = view_coordinates(view, positions[triangles[3 * i + 2]].xyz);
#if SLOTS == 1
  records[i] = raster_triangle(i, film_corner(film_coordinates(view, a)), film_corner(film_coordinates(view, b)),
                               film_corner(film_coordinates(view, c)));
#else
  // Of at most 8 corners.
  float3 polygon[8], clipped[8];
  uint n = 3;
  polygon[0] = a;
  polygon[1] = b;
  polygon[2] = c;
  UNROLL for (uint v = 3; v < 8; ++v) polygon[v] = a;
  for (uint k = view.near_distance > 0.0f ? 0 : 5; k < 5; ++k) {  // orthographic films hold the whole object
    uint m = 0;
    UNROLL for (uint v = 0; v < 8; ++v) clipped[v] = a;
    UNROLL for (uint v = 0; v < 8; ++v) {
      if (v >= n) continue;
      const float3 p = polygon[v], q = v + 1 < n ? polygon[(v + 1) & 7] : polygon[0];
      const float dp = plane_distance(view, k, p), dq = plane_distance(view, k, q);
      if (dp >= 0.0f) append(clipped, &m, p);
      if ((dp >= 0.0f) != (dq >= 0.0f)) append(clipped, &m, clip_edge(p, dp, q, dq));
    }
    n = m;
    UNROLL for (uint v = 0; v < 8; ++v) polygon[v] = clipped[v];
  }
  UNROLL for (uint s = 0; s < SLOTS; ++s) {
    RasterTriangle t;
    t.triangle = NO_TRIANGLE;
    if (s + 2 < n)
      t = raster_triangle(i, film_corner(film_coordinates(view, polygon[0])),
                          film_corner(film_coordinates(view, polygon[s + 1])),
                          film_corner(film_coordinates(view, polygon[s + 2])));
    records[SLOTS * i + s] = t;
  }
#endif
}

// Draws every `step`-th row of the box from row `first` on: depths, or ids where the depth is this triangle's; and the
// farthest depths if they are wanted.
static void draw_rows(RasterTriangle t, PixelBox box, Window window, int first, int step, __global uint* depth,
                      __global uint* ids, __global uint* farthest) {
  const i64 bias0 = edge_bias(t.x0, t.y0, t.x1, t.y1), bias1 = edge_bias(t.x1, t.y1, t.x2, t.y2),
            bias2 = edge_bias(t.x2, t.y2, t.x0, t.y0);
  const i64 step0 = -(i64)(t.y1 - t.y0) * SUBPIXELS, step1 = -(i64)(t.y2 - t.y1) * SUBPIXELS,
            step2 = -(i64)(t.y0 - t.y2) * SUBPIXELS;
  const int px0 = box.x0 * SUBPIXELS + window.sample_x;
  for (int y = box.y0 + first; y < box.y1; y += step) {
    const int py = y * SUBPIXELS + window.sample_y;
    i64 e0 = edge_function(t.x0, t.y0, t.x1, t.y1, px0, py) + bias0;
    i64 e1 = edge_function(t.x1, t.y1, t.x2, t.y2, px0, py) + bias1;
    i64 e2 = edge_function(t.x2, t.y2, t.x0, t.y0, px0, py) + bias2;
    const uint row = ((uint)y - window.y) * window.width - window.x;
    for (int x = box.x0; x < box.x1; ++x, e0 += step0, e1 += step1, e2 += step2) {
      if ((e0 | e1 | e2) < 0) continue;
      const uint pixel = row + (uint)x;
      const uint key = ~as_uint(nearness(t, x * SUBPIXELS + window.sample_x, py));
      if (!ids)
        atomic_min(&depth[pixel], key);
      else if (depth[pixel] == key)
        atomic_min(&ids[pixel], t.triangle);
      if (farthest) atomic_max(&farthest[pixel], key);
    }
  }
}

static int is_small(PixelBox box) { return box.x1 - box.x0 <= SMALL_BOX && box.y1 - box.y0 <= SMALL_BOX; }

// Depths of small triangles; the large ones are listed. `ids` null: depth pass. The id pass finds the list made.
static void draw_small(__global const RasterTriangle* records, uint i, Window window, __global uint* depth,
                       __global uint* ids, __global uint* n_large, __global uint* large) {
  const RasterTriangle t = records[i];
  if (t.triangle == NO_TRIANGLE) return;
  const PixelBox box = pixel_box(t, window);
  if (box.x0 >= box.x1 || box.y0 >= box.y1) return;
  if (is_small(box))
    draw_rows(t, box, window, 0, 1, depth, ids, 0);
  else if (large)
    large[atomic_inc(n_large)] = i;
}

static void draw_large(__global const RasterTriangle* records, uint item, uint items, Window window,
                       __global uint* depth, __global uint* ids, uint n_large, __global const uint* large) {
  for (uint unit = item; unit < n_large * LARGE_BLOCKS; unit += items) {
    const RasterTriangle t = records[large[unit / LARGE_BLOCKS]];
    draw_rows(t, pixel_box(t, window), window, (int)(unit % LARGE_BLOCKS), (int)LARGE_BLOCKS, depth, ids, 0);
  }
}

__kernel void raster_depth(const Window window, __global const RasterTriangle* restrict records, const uint n_records,
                           __global uint* n_large, __global uint* large, __global uint* depth) {
  const uint i = (uint)get_global_id(0);
  if (i < n_records) draw_small(records, i, window, depth, 0, n_large, large);
}

__kernel void raster_depth_large(const Window window, __global const RasterTriangle* restrict records,
                                 __global const uint* restrict n_large, __global const uint* restrict large,
                                 __global uint* depth) {
  const uint i = (uint)get_global_id(0), items = (uint)get_global_size(0);
  draw_large(records, i, items, window, depth, 0, n_large[0], large);
}

__kernel void raster_ids(const Window window, __global const RasterTriangle* restrict records, const uint n_records,
                         __global uint* depth, __global uint* ids) {
  const uint i = (uint)get_global_id(0);
  if (i < n_records) draw_small(records, i, window, depth, ids, 0, 0);
}

__kernel void raster_ids_large(const Window window, __global const RasterTriangle* restrict records,
                               __global const uint* restrict n_large, __global const uint* restrict large,
                               __global uint* depth, __global uint* ids) {
  const uint i = (uint)get_global_id(0), items = (uint)get_global_size(0);
  draw_large(records, i, items, window, depth, ids, n_large[0], large);
}

// The vertices of the mesh on an orthographic film.
__kernel void raster_corners(const View view, __global const float4* restrict positions, const uint n_positions,
                             __global int4* restrict corners) {
  const uint i = (uint)get_global_id(0);
  if (i < n_positions) corners[i] = film_corner(film_coordinates(view, view_coordinates(view, positions[i].xyz)));
}

// The nearest and the farthest surface on a small film, which an orthographic view and the opposite one see: many views
// in a row, so that no record is kept, and triangles between pixels' centres, nearly all of a fine mesh, cost little.
__kernel void raster_sight(const Window window, __global const int4* restrict corners,
                           __global const uint* restrict triangles, const uint n_triangles, __global uint* nearest,
                           __global uint* farthest) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const int4 a = corners[triangles[3 * i]], b = corners[triangles[3 * i + 1]], c = corners[triangles[3 * i + 2]];
  const PixelBox box = corners_box(a.x, a.y, b.x, b.y, c.x, c.y, window);
  if (box.x0 >= box.x1 || box.y0 >= box.y1) return;
  const RasterTriangle t = raster_triangle(i, a, b, c);
  if (t.triangle != NO_TRIANGLE) draw_rows(t, box, window, 0, 1, nearest, 0, farthest);
}

// The surface at a sample of a view: the first hit, both normals turned to the viewer.
typedef struct {
  float3 x;    // inside the triangle, whatever rounding did
  float3 n_g;  // geometric normal: facing, planes, depth
  float3 n_s;  // shading normal: Fresnel and refraction
} Surface;

static Surface surface_at(View view, float px, float py, uint id, __global const float4* positions,
                          __global const uint* triangles, __global const float* normals) {
  const float3 v0 = positions[triangles[3 * id]].xyz;
  const float3 e1 = positions[triangles[3 * id + 1]].xyz - v0, e2 = positions[triangles[3 * id + 2]].xyz - v0;
  const float x = (px - view.centre_x) / view.scale, y = (py - view.centre_y) / view.scale;
  float3 o = view.origin.xyz, d = -view.back.xyz;
  const float3 lateral = view.right.xyz * x + view.down.xyz * y;
  if (view.near_distance > 0.0f)
    d += lateral;
  else
    o += lateral;
  const float3 p = cross(d, e2), t = o - v0, q = cross(t, e1);  // ray against plane, as barycentric coordinates
  const float det = dot(e1, p);
  float u = det != 0.0f ? dot(t, p) / det : 1.0f / 3.0f, v = det != 0.0f ? dot(d, q) / det : 1.0f / 3.0f;
  u = clamp(u, 0.0f, 1.0f);
  v = clamp(v, 0.0f, 1.0f);
  const float excess = fmax(u + v, 1.0f);
  u /= excess;
  v /= excess;
  __global const float* n = normals + 9 * id;
  Surface s;
  s.x = v0 + e1 * u + e2 * v;
  s.n_s = normalize(vload3(0, n) * (1.0f - u - v) + vload3(1, n) * u + vload3(2, n) * v);
  const float3 n_g = cross(e1, e2);
  const float area = dot(n_g, n_g);
  s.n_g = area > 0.0f ? n_g * rsqrt(area) : s.n_s;
  if (dot(s.n_g, d) > 0.0f) {
    s.n_g = -s.n_g;
    s.n_s = -s.n_s;
  }
  return s;
}
