// Known answers asked of a device before it renders: drivers that miscompile are refused by name, not believed.
#pragma once
#include <string>
#include <vector>

#include "core/compute.hpp"
#include "scene/scene.hpp"

namespace parian {

/// One question to a device, and how it answered.
struct SelfTestAnswer {
  std::string name;   ///< what was asked, such as "barrier reduction"
  std::string found;  ///< what came back, in words: the worst error, or right and wrong values
  bool passed = false;
};

/// What the self-test's program, kernels/self_test.cl with the functions that it judges, is built with.
[[nodiscard]] std::string self_test_options(Model model, std::uint32_t lanes);

/// Asks a device, by that program, of which only tests change the source: layout of structs, exp and sqrt, a reduction
/// with barriers, an atomic minimum, one raster tile, and S_d of pairs of points against the double form. Waits.
[[nodiscard]] std::vector<SelfTestAnswer> self_test(Compute& compute, Model model, std::uint32_t lanes,
                                                    const std::string& source = self_test_sources);

/// Throws Error(device) with the device's name, the first check that failed and the remedy; with `settings.force`
/// returns that as warnings instead, one for each check. Waits.
[[nodiscard]] std::vector<std::string> require_sound(Compute& compute, const Settings& settings, std::uint32_t lanes,
                                                     const std::string& source = self_test_sources);

}  // namespace parian
