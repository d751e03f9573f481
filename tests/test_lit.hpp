// A torus lit twice, with light maps, layers and guides, and what a guide says.
#pragma once
#include <algorithm>
#include <span>

#include "test_scene.hpp"

namespace parian::test {

using kernels::float4;

inline const DirectionalLight light_a{{0.5, 0.6, -0.6}, {3, 2, 1}}, light_b{{-0.2, 0.1, 1.0}, {1, 1, 1.5}};

inline const Material one_medium = medium({1.5, 1.5, 0}, {0.01, 0.01, 0.3});  // and a black channel
inline const Material two_media = medium({2.0, 2.0, 2.6}, {0.02, 0.02, 0.005}, 1.3);
inline const Material dense = medium({90, 110, 110}, {0.1, 0.3, 0.3});

/// Texels along a side of light maps that otherwise have `size`.
inline std::uint32_t fitted_map(std::uint32_t size) { return fitted(size, std::min(size, 28U)); }

/// A torus with layers, light maps and every `step`-th covered texel needed.
struct LitBench : Bench {
  LitBench(const Material& material, std::vector<DirectionalLight> lights, std::uint32_t map_size, bool shift,
           std::size_t step, const std::function<void(Plan&)>& change, const std::string& selector = test_selector(),
           std::size_t group = 64)
      : Bench(scene_of(torus(32, 16), material, std::move(lights)), {}, change, selector) {
    map_size = fitted_map(map_size);
    compute.limit_groups(group);
    make_light_maps(passes, points, map_size);
    draw_light_maps(passes, 0, shift);
    std::vector<kernels::View> views;
    for (const glm::dvec3& d : even_directions(fitted(5, 3))) {
      views.push_back(orthographic_view(points, d, side));
      views.back().number = static_cast<cl_uint>(views.size() - 1);
    }
    make_layers(passes, views, false);
    const std::vector<cl_uint> slots = compute.read<cl_uint>(passes.layers.slots, views.size() * side * side);
    for (cl_uint t = 0, covered = 0; t < slots.size(); ++t)
      if (slots[t] == 0 && covered++ % step == 0) needed.push_back(t);
    set_needed(passes, needed);
    n = needed.size();
    const LightMaps& m = passes.light_maps;
    map = compute.read<float4>(m.map, std::size_t{2} * map_size * map_size * m.lights.size());
    at = compute.read<float4>(passes.layers.points, 2 * n);
    centres = compute.read<float4>(passes.layers.centres, n * m.lights.size());
    if (passes.layers.n_tiles == 0) return;
    const std::size_t lists = 2 * m.lights.size() * (1 + 2 * std::size_t{map_size} * map_size);
    lit = compute.read<cl_uint>(passes.layers.guides, lists);
    guides =
        compute.read<cl_uint>(passes.layers.guides, 2 * m.lights.size() * passes.layers.n_tiles * GUIDE_SIZE, lists);
    stands = compute.read<float4>(passes.layers.stands, passes.layers.n_tiles * m.lights.size());
  }
  std::vector<float4> frames(std::uint32_t count) {
    for (std::uint32_t f = 0; f < count; ++f) accumulate_layers(passes, f);
    colour_layers(passes);
    return compute.read<float4>(passes.layers.values, 2 * n);
  }
  const std::uint32_t side = fitted(24U, 14U);  // of layers, in texels
  std::size_t n = 0;
  std::vector<float4> map, at, centres, stands;
  std::vector<cl_uint> needed, guides, lit;
};

/// What guide.cl says of one tile and of one half's map of a light.
class Guide {
 public:
  Guide(const LitBench& b, std::size_t l, std::uint32_t half, std::size_t tile)
      : width_(b.passes.light_maps.size), bits_(std::countl_zero(width_ * width_ - 1) - 1) {
    if (b.passes.layers.n_tiles == 0) return;
    const std::size_t map = 2 * l + half;
    const cl_uint* list = &b.lit[map * (1 + 2 * std::size_t{width_} * width_)];
    list_ = {list + 1, list[0]};
    ranks_ = {list + 1 + std::size_t{width_} * width_, std::size_t{width_} * width_};
    const cl_uint* guide = &b.guides[(2 * (l * b.passes.layers.n_tiles + tile) + half) * GUIDE_SIZE];
    if (guide[GUIDE_STRIPS] != 0) begins_ = {guide, GUIDE_STRIPS + 1};
    codes_ = {reinterpret_cast<const std::uint8_t*>(guide + GUIDE_STRIPS + 2), GUIDE_PARTS};
  }
  explicit operator bool() const { return !begins_.empty(); }
  [[nodiscard]] std::span<const cl_uint> list() const { return list_; }
  [[nodiscard]] std::span<const cl_uint> ranks() const { return ranks_; }
  [[nodiscard]] std::span<const cl_uint> begins() const { return begins_; }
  /// A texel of the list, in units of begins().
  [[nodiscard]] double unit() const { return std::ldexp(1.0, int(bits_)); }
  /// Where a sample lies, as a place in the list in these units: exactly what the kernel does.
  [[nodiscard]] std::uint32_t place(float t) const {
    const std::size_t strip = strip_of(t);
    return begins_[strip] + std::uint32_t((t * float(strips()) - float(strip)) * float(length(strip)));
  }
  [[nodiscard]] std::size_t strips() const { return begins_.size() - 1; }
  [[nodiscard]] std::size_t strip_of(float t) const { return std::min(std::size_t(t * float(strips())), strips() - 1); }
  [[nodiscard]] std::uint32_t length(std::size_t strip) const { return begins_[strip + 1] - begins_[strip]; }
  /// In texels of the map, their samples in their middles.
  [[nodiscard]] glm::dvec2 film(std::uint32_t place, double v) const {
    const cl_uint texel = list_[place >> bits_];
    return {(texel & 0xffff) + std::fmod((place + 0.5) / unit(), 1.0), (texel >> 16) + v};
  }
  /// Per texel that is lit, as the weights of samples have it.
  [[nodiscard]] double density(std::size_t rank) const {
    const int code = codes_[std::min(std::size_t((double(rank) + 0.5) * GUIDE_PARTS / double(list_.size())),
                                     std::size_t{GUIDE_PARTS - 1})];
    return code == 0 ? 0 : std::ldexp(1 + code % 8 / 8.0, code / 8 - 12) / double(list_.size());
  }

 private:
  std::uint32_t width_;
  std::uint32_t bits_;
  std::span<const cl_uint> list_, ranks_, begins_;
  std::span<const std::uint8_t> codes_;
};

}  // namespace parian::test
