// For the plan: how well directions see the surface, which of the layers' texels a view reads, and how much of the
// surface the layers see.
#include "look_up.cl"
#include "raster.cl"

// The vertices of the mesh on an orthographic film.
__kernel void visibility_corners(const View view, __global const float4* restrict positions, const uint n_positions,
                                 __global int4* restrict corners) {
  const uint i = (uint)get_global_id(0);
  if (i < n_positions)
    corners[i] = film_corner(film_coordinates(view, to_frame(view, positions[i].xyz - view.origin.xyz)));
}

// The nearest and the farthest surface on a small film, which an orthographic view and the opposite one see: many views
// in a row, so that no record is kept, and triangles between pixels' centres, nearly all of a fine mesh, cost little.
__kernel void visibility_sight(const Window window, __global const int4* restrict corners,
                               __global const uint* restrict triangles, const uint n_triangles, __global uint* nearest,
                               __global uint* farthest) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const int4 a = corners[triangles[3 * i]], b = corners[triangles[3 * i + 1]], c = corners[triangles[3 * i + 2]];
  const PixelBox box = corners_box(a.x, a.y, b.x, b.y, c.x, c.y, window, window.sample_x, window.sample_x,
                                   window.sample_y, window.sample_y);
  if (box.x0 >= box.x1 || box.y0 >= box.y1) return;
  const RasterTriangle t = raster_triangle(i, a, b, c);
  if (t.triangle != NO_TRIANGLE) draw_rows(t, box, window, 0, 0, 0, 1, nearest, 0, farthest);
}

// For the choice of layers: how well a view and the opposite one see each point of the surface, its cosine, or 0 where
// it is hidden; one after the other from `first` on.
__kernel void visibility_cosines(const View view, __global const uint* restrict nearest,
                                 __global const uint* restrict farthest, const uint n_points,
                                 __global const float4* restrict points, const uint first,
                                 __global float* restrict quality) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  const float3 n = points[2 * i + 1].xyz,
               film = film_coordinates(view, to_frame(view, points[2 * i].xyz - view.origin.xyz));
  const float cosine = fabs(dot(n, view.back.xyz));
  const int x = clamp((int)film.x, 0, (int)view.width - 1), y = clamp((int)film.y, 0, (int)view.height - 1);
  const uint pixel = (uint)y * view.width + (uint)x;
  const int empty = nearest[pixel] == NO_DEPTH;
  const float front = empty ? 0.0f : as_float(~nearest[pixel]), back = empty ? FLT_MAX : as_float(~farthest[pixel]);
  // Within the texel the surface itself rises by its slope; a quarter more forgives the neighbours' curvature.
  const float rise = (0.25f + 0.7071f * sqrt(1.0f - fmin(cosine * cosine, 1.0f)) / fmax(cosine, 0.05f)) / view.scale;
  quality[first + i] = film.z + rise >= front ? cosine : 0.0f;
  quality[first + n_points + i] = film.z - rise <= back ? cosine : 0.0f;
}

// Marks the level-0 texels that a view reads: many may write one mark, all of them the same 1.
__kernel void visibility_mark(const View view, const Window window, __global const uint* restrict ids,
                              __global const float4* restrict positions, __global const uint* restrict triangles,
                              __global const float* restrict normals, __constant View* layer_views,
                              __constant uint* level_first, __global const float4* restrict geometry,
                              __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                              const uint position, __global uint* marks) {
  const uint item = (uint)get_global_id(0), first = FIRST_SAMPLE(item, window, position);
  const uint n = (window.width * window.height) << window.log_positions;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  for (uint i = first; i < n; i = NEXT_SAMPLE(i, window, n)) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    if (mask_all(empty)) continue;
    real px, py, total = real_splat(0.0f);
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    ROLLED for (int oblique = 0; oblique < 2; ++oblique) {
      const mask done = empty | (total >= MIN_WEIGHT);
      ROLLED for (uint layer = layers.first; layer < layers.first + layers.count; ++layer) {
        Sight sight;
        sight_of(layers, layer, 0, s.x, s.n_g, oblique ? EDGE_ON : OBLIQUE, &sight);
        if (mask_all(done | (sight.facing <= 0.0f))) continue;
        ROLLED for (uint corner = 0; corner < 4; ++corner) {
          ureal texel;
          const real weight =
              real_select(done, real_splat(0.0f), texel_weight(layers, layer, 0, &sight, corner, &texel));
          for (uint left = lanes_of(weight > 0.0f); left != 0;) {
            const uint k = 31 - clz(left);
            left ^= 1u << k;
            marks[INDEX(texel, k)] = 1;
          }
          total += weight;
        }
      }
    }
  }
}

// For statistics: the layers' total weight at points of the surface, VW to a work-item.
__kernel void visibility_weight(const uint n_points, __global const float4* restrict points,
                                __constant View* layer_views, __constant uint* level_first,
                                __global const float4* restrict geometry, __global const uint* restrict slots,
                                const uint layers_first, const uint layers_count, __global float* restrict weights) {
  const uint i = (uint)get_global_id(0) * VW;
  if (i >= n_points) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  real total = real_splat(0.0f);
#define POINT(lane) min(i + lane, n_points - 1) * 2
  const ureal point = (ureal)(OF_EACH(POINT));
#undef POINT
  const real3 x = three_at(points, point), n = three_at(points, point + 1);
  for (uint layer = layers.first; layer < layers.first + layers.count; ++layer)
    for (int side = 0; side < 2; ++side) {
      Sight s;
      sight_of(layers, layer, 0, x, real3_scale(n, real_splat(side ? -1.0f : 1.0f)), EDGE_ON, &s);
      for (uint corner = 0; corner < 4; ++corner) {
        ureal texel;
        total += texel_weight(layers, layer, 0, &s, corner, &texel);
      }
    }
  for (uint k = 0; k < VW && i + k < n_points; ++k) weights[i + k] = ELEMENT(total, k);
}
