// What a configuration converges to, and the distance from it.
#pragma once
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "scene/scene.hpp"
#include "truth/compare.hpp"

namespace parian {

/// A picture with so many samples that what's left is, but for `variance`, bias.
struct Limit {
  Image image;               ///< with its standard error
  std::uint32_t frames = 0;  ///< in all
  Comparison to_reference;
  double variance = 0;  ///< its own, relative to the reference
};

/// Limits, made when first asked for; one for all settings that converge to the same picture.
class Limits {
 public:
  /// Of `settings`, whose seed a limit that's made steps past; `frames` are those of the longest run to hold against
  /// it. Throws as Rendering and compare do.
  const Limit& of(const Settings& settings, std::uint32_t frames, const Scene& scene, const std::string& selector,
                  const Image& reference, std::vector<std::string>& warnings);

 private:
  std::map<std::tuple<Estimator, std::uint32_t, std::uint32_t, std::uint32_t>, Limit> made_;
};

}  // namespace parian
