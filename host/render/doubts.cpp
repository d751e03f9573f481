// What a renderer doubts: the sphere of a mesh that nobody on the host has seen, and pictures that show nothing.
#include <fmt/format.h>

#include <algorithm>

#include "core/words.hpp"
#include "render/renderer_state.hpp"

namespace parian {

/// Of frames so far, whether the mesh left its sphere.
void Renderer::State::look_outside() {
  if (!device_mesh) return;
  const Outside now = read_outside(passes);
  outside.triangles += now.triangles;
  outside.reach = std::max(outside.reach, now.reach);
}

/// Whether light falls on what scatters it, in a channel at least.
bool Renderer::State::lit() const {
  if (plan.dark) return false;
  for (const DirectionalLight& l : passes.light_maps.given)
    for (int c = 0; c < 3; ++c) {
      const double e = l.irradiance[c] * (plan.unit_lights ? 1.0 : colour[c]);
      const std::uint32_t medium = plan.medium_of[static_cast<std::size_t>(c)];
      if (e > 0.0 && medium < plan.channels() && plan.media[medium].scale > 0.0F) return true;
    }
  return false;
}

Expected Renderer::State::expected(std::size_t camera) const { return {centre_in_film(cameras[camera]), lit()}; }

/// What is wrong with a picture that shows nothing where something should be seen.
void Renderer::State::doubt_picture(std::size_t camera, const Halves& image) {
  const Expected should = expected(camera);
  const bool covered = std::any_of(image.alpha.begin(), image.alpha.end(), [](float alpha) { return alpha > 0.0F; });
  const auto black = [](glm::vec3 v) { return v == glm::vec3(0.0F); };
  std::string what;
  if (!covered && should.object)
    what = fmt::format(
        "camera {}: no subpixel position meets the object, although its middle lies in the film: it is thinner than "
        "they are apart, or the camera looks past it; use a larger {} or come closer",
        camera + 1, setting("film"));
  if (covered && should.light && std::all_of(image.a.begin(), image.a.end(), black) &&
      std::all_of(image.b.begin(), image.b.end(), black))
    what = fmt::format(
        "camera {}: the picture is black although light falls on the object: no light comes through to where the "
        "camera looks, or texels of its light map are larger than the object; turn the light, or use a thinner "
        "material or a larger {}",
        camera + 1, setting("light_map_size"));
  if (!what.empty() && std::find(doubts.begin(), doubts.end(), what) == doubts.end()) doubts.push_back(what);
}

}  // namespace parian
