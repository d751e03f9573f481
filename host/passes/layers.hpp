// Pass 2: the surface from many directions, and the light that leaves it there.
#pragma once
#include <CL/opencl.hpp>

#include <cstdint>
#include <vector>

#include "core/stage.hpp"
#include "kernels/types.h"

namespace parian {

struct Passes;

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
  bool guided = false;               ///< whether guides go by the light maps as they are
  cl::Buffer sums, colours;          ///< if each light has its own: values are made of them
  cl_uint n_points = 0;              ///< how many the buffers hold; the device goes by n_needed
  [[nodiscard]] cl_uint count() const { return static_cast<cl_uint>(views.size()); }
};

/// Rasterises the layers, at least one, all of the same size. All covered texels count as needed until set_needed says
/// which are.
void make_layers(Passes& p, const std::vector<kernels::View>& views, bool pyramids);
void release_layers(Passes& p);
/// Draws them again: the mesh has moved.
void draw_layers(Passes& p);
/// Makes room for so many needed texels.
void allocate_points(Passes& p, std::size_t count);
/// These texels are needed, and will be for as long as the layers last. Waits.
void set_needed(Passes& p, const std::vector<cl_uint>& needed);
/// All covered texels are needed, as many as there are: the device lists them.
void list_covered(Passes& p);
/// Where the needed texels' samples are centred, and their guides, going by the light maps as they are.
void find_centres(Passes& p);

/// One frame of samples, by guides that suit the light maps.
void accumulate_layers(Passes& p, std::uint32_t frame);
/// Its work-items, and the first frame's samples of some of them, to see how long they take.
[[nodiscard]] std::size_t accumulate_items(const Passes& p);
void try_accumulate(Passes& p, std::size_t items);
/// Values as the lights' colours are now, where these come last.
void colour_layers(Passes& p);

/// Points of any kind, and what their samples take.
struct Points {
  const cl::Buffer &count, &points, &centres;
  cl_uint n_tiles = 0;  ///< 0: without guides
};
/// `rounds` rounds of samples of light `l` from round `round` on at points of which the device knows how many there
/// are, going by `items` for no more: times `colour`, into `values` from `first_value` on, or with `add` onto them.
void accumulate(Passes& p, const Points& points, std::size_t items, cl_uint l, std::uint32_t round,
                std::uint32_t rounds, bool add, const kernels::float4& colour, cl_uint first_value,
                const cl::Buffer& values, Stage stage);
/// Work-items that take so many points.
[[nodiscard]] std::size_t items_of(const Passes& p, std::size_t points);
/// What a light's samples are still to be multiplied with where lights are added up.
[[nodiscard]] kernels::float4 colour_of(const Passes& p, std::size_t l);

}  // namespace parian
