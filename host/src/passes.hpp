// The four passes as launches on one device, and the buffers between them.
#pragma once
#include <optional>
#include <vector>

#include "compute.hpp"
#include "geometry.hpp"
#include "plan.hpp"

namespace parian {

/// The mesh on the device, and the rasteriser's buffers that every view uses in turn.
struct Geometry {
  cl::Buffer positions;    ///< float4 per vertex, object units
  cl::Buffer triangles;    ///< 3 uint per triangle
  cl::Buffer normals;      ///< 9 float per triangle: shading normals of its corners
  cl::Buffer normal_sums;  ///< of a mesh that lies on the device: 3 int per vertex
  cl::Buffer outside;      ///< of such a mesh: triangles that left the sphere, and the bits of how far, squared
  cl::Buffer records, large, n_large;
  std::optional<kernels::View> set_up;  ///< of which the records are
  cl_uint n_positions = 0, n_triangles = 0, n_records = 0;
};

/// The light maps of both halves, their height pyramids, and the lights themselves.
struct LightMaps {
  std::vector<kernels::Light> lights;
  cl::Buffer lights_buffer, map, extent, level_first;
  cl::Buffer depth, ids;
  cl_uint levels = 0, size = 0;
};

/// The layers: views, geometry of all levels, needed points and their values.
struct Layers {
  std::vector<kernels::View> views;
  cl::Buffer views_buffer, level_first_buffer, depth, view_ids, ids, geometry, slots;
  std::vector<std::uint32_t> level_first;
  cl_uint levels = 1;
  // Once the needed texels are known: how many and which, and what belongs to each.
  cl::Buffer n_needed, needed, points, centres, values;
  cl::Buffer stands, guides;         ///< of samples: where tiles lie, and where on each map their light comes from
  cl::Buffer cubes, counts, places;  ///< of one map, while its guides are made
  cl_uint n_tiles = 0;               ///< that have guides, of each light
  cl::Buffer sums, colours;          ///< if each light has its own: values are made of them
  cl_uint n_points = 0;              ///< how many the buffers hold; the device goes by n_needed
  [[nodiscard]] cl_uint count() const { return static_cast<cl_uint>(views.size()); }
};

/// The camera's film: halves A and B for up to three pyramid levels, lists of pixels that no layer sees, one for each
/// subpixel position, how many these are now and were in all, and the points of some of them with their values.
struct Film {
  cl::Buffer depth, ids, sums, direct, n_direct;
  cl::Buffer n_held, points, centres, values;
  cl::Buffer edges, open;              ///< of each pixel: whether it is an edge, and what to draw
  std::optional<kernels::View> drawn;  ///< of which ids hold `window`
  kernels::Window window{};
};

/// The layers that a view reads: all of them, or its own alone.
struct LayerRange {
  cl_uint first = 0, count = 0;
};

/// What all passes share.
struct Passes {
  Passes(Compute& c, const Plan& p) : compute(c), plan(p) {}

  Compute& compute;
  const Plan& plan;
  Geometry geometry;
  cl::Buffer media, rho;
  LightMaps light_maps;
  Layers layers;
  Film film;
  cl_uint seed = 0;
};

/// Set-up of one view, unless it's the last one; `draw` then fills depth, and ids if given, for a window of it.
void setup_view(Passes& p, const kernels::View& view, Stage stage);
/// A restricted window is the film's: see restrict_film.
void draw(Passes& p, const kernels::Window& window, const cl::Buffer& depth, const cl::Buffer* ids, Stage stage);

/// Pass 1: (re)draws the maps of all lights with the sub-texel shifts of `epoch`, and their height pyramids.
void make_light_maps(Passes& p, const std::vector<glm::dvec3>& points, std::uint32_t size);
void draw_light_maps(Passes& p, std::uint32_t epoch, bool shift);

/// Pass 2, geometry: rasterises the layers, at least one, all of the same size. All covered texels count as needed
/// until set_needed says which are.
void make_layers(Passes& p, const std::vector<kernels::View>& views, bool pyramids);
void release_layers(Passes& p);
/// Draws them again: the mesh has moved.
void draw_layers(Passes& p);
/// Marks the texels of all layers that a view reads, in `marks` (one uint per level-0 texel).
void mark_needed(Passes& p, const kernels::View& view, const kernels::Window& window, const cl::Buffer& marks);
/// Makes room for so many needed texels.
void allocate_points(Passes& p, std::size_t count);
/// These texels are needed, and will be for as long as the layers last. Waits.
void set_needed(Passes& p, const std::vector<cl_uint>& needed);
/// All covered texels are needed, as many as there are: the device lists them.
void list_covered(Passes& p);
/// Where the needed texels' samples are centred, and their guides, going by the light maps as they are.
void find_centres(Passes& p);

/// The guides anew, for light maps that have been drawn anew.
void make_guides(Passes& p);
/// Pass 2, light: one frame of samples.
void accumulate_layers(Passes& p, std::uint32_t frame);
/// Its work-items, and the first frame's samples of some of them, to see how long they take.
[[nodiscard]] std::size_t accumulate_items(const Passes& p);
void try_accumulate(Passes& p, std::size_t items);

/// Values as the lights' colours are now, where these come last.
void colour_layers(Passes& p);

/// Pass 3: levels 1 to `level`.
void build_pyramids(Passes& p, std::uint32_t level);

/// Draws a window of a view into the film's ids, unless they hold it already; returns whether it had to.
bool draw_film(Passes& p, const kernels::View& view, const kernels::Window& window, bool again, Stage stage);
/// Pass 4: adds the subpixel positions of a window of a view, which draw_film has drawn, to the film, for the given
/// levels of the layers. `scale` is 1 / frames; pixels that no layer sees take `rounds` rounds of samples at each
/// position, from round `round` on.
void gather(Passes& p, const kernels::View& view, const kernels::Window& window, const LayerRange& layers,
            const std::vector<cl_uint>& levels, float scale, std::uint32_t round, std::uint32_t rounds, Stage stage);
/// Which pixels of a window that draw_film has drawn have edges, going by its subpixel positions; `gather` adds those
/// that no layer sees.
void find_edges(Passes& p, const kernels::View& view, const kernels::Window& window);
/// After `done` of `positions` subpixel positions: pixels without an edge near by count as gathered at all positions,
/// and the others are written to the film's `open`.
void settle_film(Passes& p, const kernels::Window& window, std::size_t levels, std::uint32_t done,
                 std::uint32_t positions);
/// From now on draws nothing of this window but the pixels that are `open`, until free_film.
void restrict_film(Passes& p, const kernels::View& view, kernels::Window& window);
void free_film(Passes& p, kernels::Window& window);
/// Subtracts from the film what pass 2's function gives at the points of some pixels themselves, at the subpixel
/// positions that `gather` has just added.
void subtract_direct(Passes& p, const kernels::View& view, const kernels::Window& window,
                     const std::vector<cl_uint>& chosen, std::uint32_t round, std::uint32_t rounds, Stage stage);

/// The sub-texel or subpixel position with index `i` of a sequence started at `start`, in 1/256: points of R2, each
/// followed by its mirror image, since positions that aren't centred shift the image: 64 of R2 alone by 0.02 pixels,
/// which is 1 % of the light at a silhouette.
[[nodiscard]] glm::ivec2 subpixel_position(std::uint32_t i, std::uint32_t start);
/// Has a window drawn at the film's subpixel positions from `first` on, as many side by side as can be but no more than
/// `left`; returns how many.
std::uint32_t set_positions(kernels::Window& w, std::uint32_t first, std::uint32_t left);

}  // namespace parian
