// Rasterisation on integers: edge functions, top-left rule, nearness planes. Pure functions, exact on every device.
#ifndef PARIAN_RASTER_H
#define PARIAN_RASTER_H
#include "types.h"

#define SUBPIXELS 256          // positions per pixel and axis: 8 bits
#define SMALL_BOX 16           // triangles up to 16 x 16 samples are drawn by one work-item
#define LARGE_BLOCKS 16u       // larger ones by 16, interleaved by rows
#define GUARD_PIXELS 32768.0f  // triangles farther from the axis are clipped: edges fit in 64 bits with room
#define NO_TRIANGLE 0xffffffffu
#define NO_DEPTH 0xffffffffu

KERNEL_HEADER_BEGIN

// Twice the signed area of (a, b, p) in 1/256 pixels squared; positive when p lies left of a -> b, y pointing down.
SHARED i64 edge_function(int ax, int ay, int bx, int by, int px, int py) {
  return (i64)(bx - ax) * (i64)(py - ay) - (i64)(by - ay) * (i64)(px - ax);
}

// Samples exactly on an edge belong to the triangle only if the edge is a left or a top one: bias 0, else -1.
SHARED i64 edge_bias(int ax, int ay, int bx, int by) {
  const int left = by < ay;
  const int top = by == ay && bx > ax;
  return (left || top) ? 0 : -1;
}

// True when the sample at (px, py) belongs to the triangle.
SHARED int covers(RasterTriangle t, int px, int py) {
  return edge_function(t.x0, t.y0, t.x1, t.y1, px, py) + edge_bias(t.x0, t.y0, t.x1, t.y1) >= 0 &&
         edge_function(t.x1, t.y1, t.x2, t.y2, px, py) + edge_bias(t.x1, t.y1, t.x2, t.y2) >= 0 &&
         edge_function(t.x2, t.y2, t.x0, t.y0, px, py) + edge_bias(t.x2, t.y2, t.x0, t.y0) >= 0;
}

// Nearness at a sample, never beyond the corners' own: needle triangles would extrapolate.
SHARED float nearness(RasterTriangle t, int px, int py) {
  const float q = t.q0 + t.q_x * (float)(px - t.x0) + t.q_y * (float)(py - t.y0);
  return q < t.q_min ? t.q_min : (q > t.q_max ? t.q_max : q);
}

// First pixel whose sample (pixel * 256 + offset) is at or after `position`.
SHARED int first_pixel(int position, int offset) {
  const int d = position - offset + (SUBPIXELS - 1);
  return d >= 0 ? d / SUBPIXELS : -((-d + SUBPIXELS - 1) / SUBPIXELS);
}

// Pixels of a window whose samples a box holds: [x0, x1) x [y0, y1), in film coordinates.
typedef struct {
  int x0, y0, x1, y1;
} PixelBox;

SHARED int min3(int a, int b, int c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); }
SHARED int max3(int a, int b, int c) { return a > b ? (a > c ? a : c) : (b > c ? b : c); }

// Those of the box of three corners, if samples lie from `low` to `high` in their pixels.
SHARED PixelBox corners_box(int x0, int y0, int x1, int y1, int x2, int y2, Window w, int low_x, int high_x, int low_y,
                            int high_y) {
  PixelBox b;
  const int left = (int)w.x, top = (int)w.y, right = (int)(w.x + w.width), bottom = (int)(w.y + w.height);
  b.x0 = first_pixel(min3(x0, x1, x2), high_x);
  b.y0 = first_pixel(min3(y0, y1, y2), high_y);
  b.x1 = first_pixel(max3(x0, x1, x2) + 1, low_x);
  b.y1 = first_pixel(max3(y0, y1, y2) + 1, low_y);
  b.x0 = b.x0 < left ? left : b.x0;
  b.y0 = b.y0 < top ? top : b.y0;
  b.x1 = b.x1 > right ? right : b.x1;
  b.y1 = b.y1 > bottom ? bottom : b.y1;
  return b;
}

SHARED PixelBox pixel_box(RasterTriangle t, Window w) {
  return corners_box(t.x0, t.y0, t.x1, t.y1, t.x2, t.y2, w, w.sample_x, w.sample_x, w.sample_y, w.sample_y);
}

// Wherever in their pixels samples lie.
SHARED PixelBox any_pixel_box(RasterTriangle t, Window w) {
  return corners_box(t.x0, t.y0, t.x1, t.y1, t.x2, t.y2, w, 0, SUBPIXELS - 1, 0, SUBPIXELS - 1);
}

KERNEL_HEADER_END
#endif
