// Every struct that crosses between host and device: scalars of 32 bits and float4 only, sizes in multiples of 16
// bytes.
#ifndef PARIAN_TYPES_H
#define PARIAN_TYPES_H
#include "portable.h"

KERNEL_HEADER_BEGIN

// One channel of a medium, ready for bssrdf.h; lengths in transport mean free paths (1/sigma_t') of that channel.
// What z_v, fluence and scale stand for depends on the model (see bssrdf.h); ior-dependent factors are inside.
//   sigma_t_prime  reduced extinction per unit of the positions passed in
//   sigma_tr       effective transport coefficient
//   d_e            extrapolation length (FHK 21)
//   z_v            distance of the virtual source from the boundary
//   a_back         squared distance offset of backlit points (FHK 25)
//   fluence        weight of the fluence term, C_phi / D, and
//   C_E            of the flux term: of the better dipole only
//   scale          everything constant in front of the dipole, sigma_t'^2 included
#define MEDIUM_FIELDS(T) T sigma_t_prime, sigma_tr, d_e, z_v, a_back, fluence, C_E, scale;
typedef struct {
  MEDIUM_FIELDS(float)
} Medium;

// Refraction at the boundary; eta_sq_minus_1 comes from double precision, since it cancels near eta = 1. fluence is
// what the directional dipole weighs fluence with if flux has weight 1: 3 C_phi / C_E.
#define BOUNDARY_FIELDS(T) T eta_sq, eta_sq_minus_1, inverse_eta, fluence;
typedef struct {
  BOUNDARY_FIELDS(float)
} Boundary;

// How a view turns points into film: orthographic (near_distance = 0) or pinhole. Pixel coordinates have their origin
// at the film's top left corner; depth is kept as nearness q, which is linear on film and larger nearer the viewer:
// (x - origin).back + 2 for an orthographic view, 1 / distance for a pinhole.
typedef struct {
  float4 origin;  // a point on the view's axis; the eye of a pinhole
  float4 right;   // unit vectors; pixel x grows along right, pixel y along down, back points at the viewer
  float4 down;
  float4 back;
  float scale;     // pixels per unit; of a pinhole, focal length in pixels
  float centre_x;  // film coordinates of the axis
  float centre_y;
  float near_distance;  // of a pinhole; 0 marks an orthographic view
  uint width;           // film size in pixels
  uint height;
  uint number;  // of a layer: tells its texels' samples from those of other layers
  uint pad;
} View;

// The part of a film that buffers hold, and where in each pixel its samples lie (1/256 pixels): one, or
// 2^log_positions side by side, of which `subpixels` packs x and y in bytes, position after position. Of a restricted
// one, only pixels that are open are drawn.
typedef struct {
  uint x;
  uint y;
  uint width;
  uint height;
  int sample_x;
  int sample_y;
  uint log_positions;
  uint restricted;
  uint subpixels[4];
} Window;

// A triangle as the rasteriser sees it, stored once per view; everything after it is exact.
typedef struct {
  int x0, y0, x1, y1, x2, y2;  // corners on film in 1/256 pixels, counter-clockwise so that the area is positive
  float q0, q_x, q_y;          // nearness at corner 0 and its slope per 1/256 pixel
  float q_min, q_max;          // nearness of the farthest and nearest corner
  uint triangle;               // index in the mesh; NO_TRIANGLE where nothing is left to draw
} RasterTriangle;

// A directional light and the two light maps (halves A and B) that sample it.
typedef struct {
  View view;          // orthographic; back points towards the light
  float4 irradiance;  // that is summed, RGB on a surface that faces the light, divided by a frame's samples of a half
  float sample_x[2];  // where in its pixel each half's map has its samples, in pixels
  float sample_y[2];
  uint samples;  // of each half in one frame
  uint map;      // first texel of half A in the light maps' buffer; half B follows
  uint extent;   // first node of this light's height pyramid
  uint number;   // in the scene: tells its samples from those of other lights
} Light;

// The radial density of samples around a point's nearest lit place, as a table of rho over equal steps of log G
// (sampling.h); the baselines use sigma and radius instead.
typedef struct {
  float log_G_min;     // log G of entry 0, the largest rho; below it nothing is sampled
  float inverse_step;  // 1 / step of log G between entries
  uint entries;
  float h_min;   // smallest distance that matters to the density, 1.5 D
  float sigma;   // decay of the exponential radii
  float radius;  // where exponential radii end, and the radius of the uniform disc
  float pad0;
  float pad1;
} Density;

// Every struct above with its last field: where that lies tells whether host and device lay the struct out alike.
#define STRUCTS_THAT_CROSS(F) \
  F(Medium, scale)            \
  F(Boundary, fluence) F(View, pad) F(Window, subpixels) F(RasterTriangle, triangle) F(Light, number) F(Density, pad1)

// Of a layer's texel that has no values.
#define NO_SLOT 0xffffffffu

// Points that a work-item of pass 2 takes on a device with several lanes; with one lane it takes one half of one point.
#define POINTS_SIDE_BY_SIDE 8u

// Subpixel positions that are drawn and gathered side by side, at most.
#define POSITIONS_SIDE_BY_SIDE 8u

// Ranges of squared distances that a mesh in buffers is measured by: floats that share exponent and two bits more.
#define REACH_SHIFT 21
#define REACH_COUNTS (0x7f800000u >> REACH_SHIFT)

// Guides of samples (guide.cl): texels along a side of a tile that shares one, and strips of a guide; cubes
// along a side of the curve through what is lit, and work-items that add up what these hold; ranges of a list, and
// parts of a range; the numbers that a guide takes.
#define GUIDE_TILE 16u
#define GUIDE_STRIPS 1024u
#define GUIDE_SIDE 32u
#define GUIDE_CUBES (GUIDE_SIDE * GUIDE_SIDE * GUIDE_SIDE)
#define GUIDE_ITEMS 64u
#define GUIDE_RANGES 256u
#define PARTS_OF_RANGE 32u
#define GUIDE_PARTS (GUIDE_RANGES * PARTS_OF_RANGE)
#define GUIDE_SIZE (GUIDE_STRIPS + 2u + GUIDE_PARTS / 4u)

// The self-test's work-items, and the smallest of the numbers that they offer to an atomic minimum.
#define SELF_TEST_ITEMS 64
#define SELF_TEST_MINIMUM 5u

// Independent chains of multiply-adds in a work-item of `parian bench`: enough to hide the latency of two units that
// take five cycles each, few enough for sixteen registers.
#define PEAK_CHAINS 12

#ifdef __cplusplus
// The same constants unrounded, for the double form.
typedef struct {
  MEDIUM_FIELDS(double)
} ExactMedium;
typedef struct {
  BOUNDARY_FIELDS(double)
} ExactBoundary;
static_assert(sizeof(Medium) == 32 && sizeof(Boundary) == 16);
#endif

KERNEL_HEADER_END
#endif
