// The command line's way into the C API: a scene as it was loaded, set in a renderer, and what that says of itself.
#pragma once
#include <parian/parian.hpp>

#include "device.hpp"
#include "scene.hpp"

namespace parian {

/// Runs `f`, turning failures of the API into Error.
template <class F>
decltype(auto) with_failures(F&& f);

/// A renderer on the device that `selector` means, with the scene and settings set; the geometry is taken from the
/// scene, since at millions of triangles each copy counts. Throws Failure.
[[nodiscard]] Renderer make_renderer(Scene& scene, const Settings& settings, const std::string& selector);

/// Its device and its statistics as the files of the command line have them.
[[nodiscard]] DeviceInfo device_of(const Renderer& renderer);
[[nodiscard]] Statistics statistics_of(const Renderer& renderer);

/// The finished image of a camera.
[[nodiscard]] Image read_image(Renderer& renderer, std::size_t camera, glm::uvec2 film);

/// Throws the Error that a failure of the API stands for.
[[noreturn]] void rethrow(const Failure& failure);

template <class F>
decltype(auto) with_failures(F&& f) {
  try {
    return f();
  } catch (const Failure& failure) {
    rethrow(failure);
  }
}

}  // namespace parian
