// Pass 2, geometry: what each layer sees of the surface, and the points of the texels that are needed.

// Geometry of every texel of one layer, (n_g in the layer's frame, q), its triangle, and slot 0 (covered) or NO_SLOT
// (empty): VW texels to a work-item.
__kernel void layers_resolve(const View view, const Window window, __global const uint* restrict ids,
                             __global const float4* restrict positions, __global const uint* restrict triangles,
                             __global const float* restrict normals, const uint first,
                             __global uint* restrict layer_ids, __global float4* restrict geometry,
                             __global uint* restrict slots) {
  const uint i = (uint)get_global_id(0) * VW, n = window.width * window.height;
  if (i >= n) return;
  mask empty;
  const ureal id = triangles_at(ids, i, n, &empty);
  real3 n_g = uniform3((float4)(0.0f));
  real q = real_splat(0.0f);
  if (!mask_all(empty)) {
    real px, py;
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    n_g = real3_select(empty, n_g, to_frame_wide(view, s.n_g));
    const real z = real3_dot(real3_sub(s.x, uniform3(view.origin)), uniform3(view.back));
    q = real_select(empty, q, view.near_distance > 0.0f ? -1.0f / z : z + 2.0f);
  }
  for (uint k = 0; k < VW && i + k < n; ++k) {
    layer_ids[first + i + k] = ids[i + k];
    geometry[first + i + k] = (float4)(ELEMENT(n_g.x, k), ELEMENT(n_g.y, k), ELEMENT(n_g.z, k), ELEMENT(q, k));
    slots[first + i + k] = ids[i + k] != NO_TRIANGLE ? 0 : NO_SLOT;
  }
}

// Lists all covered texels, in whatever order: nothing depends on where in the list a texel stands.
__kernel void layers_list(const uint n_texels, __global uint* restrict slots, __global uint* n_needed,
                          __global uint* restrict needed) {
  const uint t = (uint)get_global_id(0);
  if (t >= n_texels || slots[t] == NO_SLOT) return;
  const uint slot = atomic_inc(n_needed);
  slots[t] = slot;
  needed[slot] = t;
}

// The needed texels' points: (x, texel) and (n_s, tile), and where their samples are centred: light after light.
__kernel void layers_points(__constant View* views, __global const uint* restrict n_needed,
                            __global const uint* restrict needed, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, const Boundary boundary, const Density density,
                            __global const float2* restrict rho, __global const float2* restrict extent,
                            __constant uint* level_first, const uint levels, const uint n_lights,
                            __global float4* restrict points, __global float4* restrict centres) {
  const uint i = (uint)get_global_id(0), n_points = n_needed[0];
  if (i >= n_points) return;
  const uint texel = needed[i], size = views[0].width * views[0].height, layer = texel / size, t = texel % size;
  const View view = views[layer];
  const Point p = point_at(view, (float)(t % view.width) + 0.5f, (float)(t / view.width) + 0.5f, ids[texel], positions,
                           triangles, normals);
  const uint number = point_number(view.number, view.width, view.height, t % view.width, t / view.width);
  points[2 * i] = (float4)(p.x, as_float(number | POINT_BITS));
  const uint columns = (view.width + GUIDE_TILE - 1) / GUIDE_TILE, rows = (view.height + GUIDE_TILE - 1) / GUIDE_TILE;
  const uint tile = (layer * rows + t / view.width / GUIDE_TILE) * columns + t % view.width / GUIDE_TILE;
  points[2 * i + 1] = (float4)(p.n_s, as_float(tile | POINT_BITS));
  for (uint l = 0; l < n_lights; ++l)
    centres[l * n_points + i] =
        sampling_centre(p.x, p.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
}

// For the choice of layers: how well a view and the opposite one see each point of the surface, its cosine, or 0 where
// it is hidden; one after the other from `first` on.
__kernel void layers_visibility(const View view, __global const uint* restrict nearest,
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
