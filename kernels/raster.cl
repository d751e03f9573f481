// Triangles to visibility: set-up once per view, then nearest depth, then the lowest triangle id at that depth.
// Used by passes 1, 2 and 4. RECORDS is the number of set-up records per triangle: 1, or 6 where clipping may happen.
#ifndef PARIAN_RASTER_CL
#define PARIAN_RASTER_CL
#include "film.cl"

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

#if RECORDS > 1
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
  const float3 a = to_frame(view, positions[triangles[3 * i]].xyz - view.origin.xyz);
  const float3 b = to_frame(view, positions[triangles[3 * i + 1]].xyz - view.origin.xyz);
  const float3 c = to_frame(view, positions[triangles[3 * i + 2]].xyz - view.origin.xyz);
#if RECORDS == 1
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
  UNROLL for (uint s = 0; s < RECORDS; ++s) {
    RasterTriangle t;
    t.triangle = NO_TRIANGLE;
    if (s + 2 < n)
      t = raster_triangle(i, film_corner(film_coordinates(view, polygon[0])),
                          film_corner(film_coordinates(view, polygon[s + 1])),
                          film_corner(film_coordinates(view, polygon[s + 2])));
    records[RECORDS * i + s] = t;
  }
#endif
}

// Draws every `step`-th row of the box from row `first` on, at subpixel position number `position`, (sample_x,
// sample_y): depths, or ids where the depth is this triangle's; and the farthest depths if they are wanted.
static void draw_rows(RasterTriangle t, PixelBox box, Window window, __global const uint* open, uint position,
                      int first, int step, __global uint* depth, __global uint* ids, __global uint* farthest) {
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
      if ((e0 | e1 | e2) < 0 || (window.restricted && !open[row + (uint)x])) continue;
      const uint sample = ((row + (uint)x) << window.log_positions) + position;
      const uint key = ~as_uint(nearness(t, x * SUBPIXELS + window.sample_x, py));
      if (ids && depth[sample] != key) continue;
      atomic_min((ids ? ids : depth) + sample, ids ? t.triangle : key);
      if (farthest) atomic_max(&farthest[sample], key);
    }
  }
}

// An edge function's value at samples side by side relative to the first one's pixel.
static mask edge_of_lanes(int ax, int ay, int bx, int by, mask x, mask y) {
  return (bx - ax) * y - (by - ay) * x + (int)edge_bias(ax, ay, bx, by);
}

// Draws a small triangle at all subpixel positions: samples side by side are positions of one pixel, then of the next.
// Within a small triangle edge functions fit in 32 bits.
SHARED void draw_samples(RasterTriangle t, PixelBox box, Window window, __global const uint* open, __global uint* depth,
                         __global uint* ids) {
  const uint log_positions = window.log_positions, positions = 1u << log_positions;
  const int pixels = max(VW >> (int)log_positions, 1);
  for (uint position = 0; position < positions; position += VW) {
    mask sub_x, sub_y;
    subpixel(window, subpixels_at(window, position), &sub_x, &sub_y);
    const mask column = convert_mask(SIDE_BY_SIDE >> log_positions);
    const mask lane_x = column * SUBPIXELS + sub_x;
    const mask lanes0 = edge_of_lanes(t.x0, t.y0, t.x1, t.y1, lane_x, sub_y);
    const mask lanes1 = edge_of_lanes(t.x1, t.y1, t.x2, t.y2, lane_x, sub_y);
    const mask lanes2 = edge_of_lanes(t.x2, t.y2, t.x0, t.y0, lane_x, sub_y);
    for (int y = box.y0; y < box.y1; ++y) {
      const uint row = ((uint)y - window.y) * window.width - window.x;
      for (int x = box.x0; x < box.x1; x += pixels) {
        uint wanted = (1u << VW) - 1;
        for (int k = 0; window.restricted && k < min(pixels, box.x1 - x); ++k)
          if (!open[row + (uint)(x + k)]) wanted &= ~(((1u << positions) - 1) << (k << log_positions));
        if (!wanted) continue;
        const int px = x * SUBPIXELS, py = y * SUBPIXELS;
        const mask e0 = lanes0 + ((t.x1 - t.x0) * (py - t.y0) - (t.y1 - t.y0) * (px - t.x0));
        const mask e1 = lanes1 + ((t.x2 - t.x1) * (py - t.y1) - (t.y2 - t.y1) * (px - t.x1));
        const mask e2 = lanes2 + ((t.x0 - t.x2) * (py - t.y2) - (t.y0 - t.y2) * (px - t.x2));
        const mask outside = ((e0 | e1 | e2) < 0) | (column >= box.x1 - x);
        uint left = wanted & ~lanes_of(outside);
        if (left == 0) continue;
        real q = t.q0 + t.q_x * convert_real(lane_x + (px - t.x0)) + t.q_y * convert_real(sub_y + (py - t.y0));
        q = real_select(q > t.q_max, real_splat(t.q_max), q);
        q = real_select(q < t.q_min, real_splat(t.q_min), q);
        const uint first = ((row + (uint)x) << log_positions) + position;
        while (left != 0) {
          const uint k = 31 - clz(left);
          left ^= 1u << k;
          const uint key = ~as_uint(ELEMENT(q, k));
          if (ids && depth[first + k] != key) continue;
          atomic_min((ids ? ids : depth) + first + k, ids ? t.triangle : key);
        }
      }
    }
  }
}

static int is_small(RasterTriangle t) {
  return max3(t.x0, t.x1, t.x2) - min3(t.x0, t.x1, t.x2) <= SMALL_BOX * SUBPIXELS &&
         max3(t.y0, t.y1, t.y2) - min3(t.y0, t.y1, t.y2) <= SMALL_BOX * SUBPIXELS;
}

// Small triangles; the large ones are listed. `ids` null: depth pass. The id pass finds the list made.
SHARED void draw_small(__global const RasterTriangle* records, uint i, Window window, __global const uint* open,
                       __global uint* depth, __global uint* ids, __global uint* n_large, __global uint* large) {
  const RasterTriangle t = records[i];
  if (t.triangle == NO_TRIANGLE) return;
  const PixelBox box = window.log_positions > 0 ? any_pixel_box(t, window) : pixel_box(t, window);
  if (box.x0 >= box.x1 || box.y0 >= box.y1) return;
  if (!is_small(t) && large) large[atomic_inc(n_large)] = i;
  if (!is_small(t)) return;
  if (window.log_positions == 0)
    draw_rows(t, box, window, open, 0, 0, 1, depth, ids, 0);
  else
    draw_samples(t, box, window, open, depth, ids);
}

static void draw_large(__global const RasterTriangle* records, uint item, uint items, Window window,
                       __global const uint* open, __global uint* depth, __global uint* ids, uint n_large,
                       __global const uint* large) {
  for (uint unit = item; unit < n_large * LARGE_BLOCKS; unit += items) {
    const RasterTriangle t = records[large[unit / LARGE_BLOCKS]];
    for (uint position = 0; position < 1u << window.log_positions; ++position) {
      mask x, y;
      subpixel(window, (ureal)(position), &x, &y);
      Window w = window;
      w.sample_x = (int)INDEX(x, 0);
      w.sample_y = (int)INDEX(y, 0);
      draw_rows(t, pixel_box(t, w), w, open, position, (int)(unit % LARGE_BLOCKS), (int)LARGE_BLOCKS, depth, ids, 0);
    }
  }
}

// Nothing has been drawn at open pixels; at the others, nothing at any time if they are the window's `first`.
__kernel void raster_clear(const Window window, __global const uint* restrict open, const uint first,
                           __global uint* restrict depth, __global uint* restrict ids) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height) return;
  if (!open[i] && !first) return;
  for (uint k = i << window.log_positions; k < (i + 1) << window.log_positions; ++k) {
    depth[k] = NO_DEPTH;
    ids[k] = NO_TRIANGLE;
  }
}

__kernel void raster_depth(const Window window, __global const uint* restrict open,
                           __global const RasterTriangle* restrict records, const uint n_records,
                           __global uint* n_large, __global uint* large, __global uint* depth) {
  const uint i = (uint)get_global_id(0);
  if (i < n_records) draw_small(records, i, window, open, depth, 0, n_large, large);
}

__kernel void raster_depth_large(const Window window, __global const uint* restrict open,
                                 __global const RasterTriangle* restrict records, __global const uint* restrict n_large,
                                 __global const uint* restrict large, __global uint* depth) {
  const uint i = (uint)get_global_id(0), items = (uint)get_global_size(0);
  draw_large(records, i, items, window, open, depth, 0, n_large[0], large);
}

__kernel void raster_ids(const Window window, __global const uint* restrict open,
                         __global const RasterTriangle* restrict records, const uint n_records, __global uint* depth,
                         __global uint* ids) {
  const uint i = (uint)get_global_id(0);
  if (i < n_records) draw_small(records, i, window, open, depth, ids, 0, 0);
}

__kernel void raster_ids_large(const Window window, __global const uint* restrict open,
                               __global const RasterTriangle* restrict records, __global const uint* restrict n_large,
                               __global const uint* restrict large, __global uint* depth, __global uint* ids) {
  const uint i = (uint)get_global_id(0), items = (uint)get_global_size(0);
  draw_large(records, i, items, window, open, depth, ids, n_large[0], large);
}

#endif
