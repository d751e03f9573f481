// What the kernels' work costs: operations and bytes, counted in their source, here and in no other place.
//
// Operations: every sum, difference, product, quotient, root and exponential of floating-point numbers that the source
// writes is one, those of its helpers included. Comparisons, minima, selections, roundings, conversions and integers
// are none. Bytes: what a work-item reads and writes for itself, each element once. Of arrays that many look up (mesh,
// tables, light maps, layers) only what the comments name: the figures are lower bounds.
#pragma once
#include "kernels/types.h"

namespace parian::costs {

/// Of one work-item.
struct Cost {
  double operations = 0, bytes = 0;
};

// portable.h: an exponential is 20, expm1 21; an inverse root is one, though with several lanes it is made of twelve.
// bssrdf.h, once for all channels of a pair of points; a dot is 5, a cross 9, a normalize 9:
inline constexpr double normal_part = 41;       // three crosses, one of them for parallel vectors, dot, normalize
inline constexpr double dipole_geometry = 73;   // three crosses, six dots, root, scale 2, two products of 6, limit
inline constexpr double refract_into = 29;      // dot, root of 3, difference, scale 3, difference 3, dot 6, scale 8
inline constexpr double transmittance = 17;     // root of 3, s and p 3, inverse 2, by_s and by_p 2, the last line 7
inline constexpr double bend_normal = 55;       // dot, scale 3, a + b s 6, normal_part
inline constexpr double directional_pair = 13;  // what of directional_dipole doesn't depend on the medium
// For each channel, without what only depends on the medium:
inline constexpr double directional_dipole = 111;  // alpha and beta 8, r2 1, offset 5, sources 14, gradients of u and v
                                                   // 10, their differences 10, B_v 7, DB 9, S 47
inline constexpr double standard_dipole = 62;      // distances 7, two attenuations of 21, two gradients of 4, sum 5
inline constexpr double better_dipole = 118;       // distances 14, flux 52, fluence 48, sum 4

// scattering.cl, a pair: numbers of the sequence 3, turn 26, place on the map 8, texel 6, offsets 6, height 4, normal
// 7, x 3, flux 1. What is the same for all samples of a point isn't counted, nor what guides add for points that have
// one.
inline constexpr double sample = 64 + refract_into + transmittance + dipole_geometry;
inline constexpr double density_radius = 34, exponential_radius = 28, disc_radius = 2;  // sample_radius by ESTIMATOR
inline constexpr double sum_of_channel = 2;
// A point: position, normal and centre read, the values of both halves read and written. A pair: one texel of a map,
// but each map no more than once a launch.
inline constexpr double accumulate_bytes = 3 * 16 + 2 * 2 * 16, map_texel_bytes = 16;

// raster.cl. Set-up: three corners to view 18 and film 5, raster_triangle 17; numbers of the corners, half a vertex
// (closed meshes have two triangles to a vertex), the record. Drawing is on integers, but for four operations at each
// covered sample, which aren't counted; it reads the record.
inline constexpr Cost raster_setup{3 * (18 + 5) + 17, 12 + 8 + sizeof(kernels::RasterTriangle)};
inline constexpr Cost raster_draw{0, sizeof(kernels::RasterTriangle)};
// Edges 6, ray 16, barycentric coordinates 41, place 12, shading normal 26, geometric normal 23.
inline constexpr double surface_at = 124;

// light_map.cl: a covered texel of one half (place 4, normals in the frame 30, the rest 13); a texel's extent; a node
// of the pyramid above.
inline constexpr Cost light_map_resolve{4 + surface_at + 30 + bend_normal + 13, 4 + 16};
inline constexpr Cost light_map_extent{5, 16 + 8};
inline constexpr Cost light_map_extent_up{0, 4 * 8 + 8};

// pyramids.cl, a texel with four children: 16 weights of 20, places 16, averages 112, the rest 23. Slot, geometry and
// two values of each of the five.
inline constexpr Cost pyramids_level{16 * 20 + 16 + 112 + 23, 5 * (4 + 16 + 2 * 16)};

// gather.cl, a covered pixel at one level: place 4, surface, T21 34 and bend_normal, four texels' values 52, means 6,
// film 14. Then each layer's cosine 6, and the rest of sight_of and texel_weight for layers that look at the point less
// obliquely than OBLIQUE: (1 - sqrt(0.2)) / 2 of directions spread evenly. Its triangle, the film, and one look-up of
// four texels.
inline constexpr Cost gather_pixel{4 + surface_at + 34 + bend_normal + 52 + 6 + 14,
                                   4 + 2 * 2 * 16 + 4 * (4 + 16 + 2 * 16)};
inline constexpr double gather_layer = 6 + 0.276 * 137;

}  // namespace parian::costs
