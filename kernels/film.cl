// Films: points of a view on its film, the sides of a mip chain's levels, and where in their pixels samples lie.
#ifndef PARIAN_FILM_CL
#define PARIAN_FILM_CL
#include "raster.h"

// Pixels along one side of a level; sizes halve upwards.
static uint level_size(uint size, uint level) { return (size + (1u << level) - 1) >> level; }

// A sum that all devices round alike: in dot() they may fuse, and add in any order.
static float inner(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static float3 to_frame(View view, float3 v) {  // film right, film down, towards the viewer
  return (float3)(inner(v, view.right.xyz), inner(v, view.down.xyz), inner(v, view.back.xyz));
}

// (film x, film y, nearness) of view coordinates.
static float3 film_coordinates(View view, float3 c) {
  if (view.near_distance > 0.0f) {
    const float q = -1.0f / c.z;
    return (float3)(view.centre_x + view.scale * c.x * q, view.centre_y + view.scale * c.y * q, q);
  }
  return (float3)(view.centre_x + view.scale * c.x, view.centre_y + view.scale * c.y, c.z + 2.0f);
}

// Samples side by side, of pixels with 2^log_positions each: which of its pixel's positions is sample `first` + lane.
SHARED ureal subpixels_at(Window window, uint first) {
  return (first + SIDE_BY_SIDE) & ((1u << window.log_positions) - 1);
}

// Where in its pixel such a position is, in 1/256 pixels.
SHARED void subpixel(Window w, ureal position, mask* x, mask* y) {
  if (w.log_positions == 0) {
    *x = (mask)(w.sample_x);
    *y = (mask)(w.sample_y);
    return;
  }
  const mask pair = convert_mask(position >> 1);
  const ureal low = select((ureal)(w.subpixels[0]), (ureal)(w.subpixels[1]), pair == 1);
  const ureal high = select((ureal)(w.subpixels[2]), (ureal)(w.subpixels[3]), pair == 3);
  const ureal packed = select(low, high, pair >= 2) >> ((position & 1) * 16);
  *x = convert_mask(packed & 255u);
  *y = convert_mask((packed >> 8) & 255u);
}

// Samples of a film side by side, from sample `first` on: where on it they lie.
static void film_samples(Window window, uint first, real* px, real* py) {
  const uint log_positions = window.log_positions, pixel = first >> log_positions;
  const ureal after = ((first & ((1u << log_positions) - 1)) + SIDE_BY_SIDE) >> log_positions;
  const real along = real_from_bits(pixel % window.width + after);  // the row, and on into those below
  const real below = floor((along + 0.5f) / (float)window.width);
  mask x, y;
  subpixel(window, subpixels_at(window, first), &x, &y);
  *px = along - below * (float)window.width + (float)window.x + convert_real(x) * (1.0f / SUBPIXELS);
  *py = below + (float)(window.y + pixel / window.width) + convert_real(y) * (1.0f / SUBPIXELS);
}

// Samples of a window that a work-item takes, the first and those after it, up to `n`: VW or more, those of whole
// pixels; with one lane the one at a single position, since in a loop a GPU would keep what is the same for all in more
// registers than it has.
#if VW == 1
#define FIRST_SAMPLE(item, window, position) (((item) << (window).log_positions) + (position))
#define NEXT_SAMPLE(i, window, n) (n)
#else
#define FIRST_SAMPLE(item, window, position) ((item)*max(1u << (window).log_positions, (uint)VW))
#define NEXT_SAMPLE(i, window, n) \
  (((i) + VW) >> (window).log_positions == (i) >> (window).log_positions ? (i) + VW : (n))
#endif

#endif
