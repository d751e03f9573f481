// `parian check`: whether this device and driver compute what they should, as a list of results.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "truth/trial.hpp"

namespace parian {

/// What was checked, what is documented to happen, and what did.
struct CheckResult {
  std::string section;  ///< "self-test", "vectors", "random", "optical", ...
  std::string name;
  std::string outcome;  ///< documented
  std::string found;
  double error = 0, allowed = 0;  ///< both 0 where there is nothing to measure
  bool passed = false;
  double seconds = 0;
};

struct CheckReport {
  DeviceInfo device;
  std::uint32_t seed = 0;
  std::vector<CheckResult> results;
  std::vector<VectorCase> worst;  ///< of each model's pairs of points, the one that takes most of its tolerance
  [[nodiscard]] bool passed() const;
};

/// What to check, on what.
struct CheckSettings {
  std::string device;                       ///< as Renderer takes it
  std::uint32_t seed = 0;                   ///< of the random cases
  std::size_t random_cases = 100000;        ///< for each model
  bool scenes = true;                       ///< whether to render the extreme cases and the stiff scenes, too
  std::string program = self_test_sources;  ///< that is judged; only tests change it
  std::function<void(const CheckResult&)> progress = [](const CheckResult&) {};  ///< is told each result at once
};

/// The self-test, random pairs of points, the extreme cases and the stiff scenes. Throws Error(device) when there is no
/// such device.
[[nodiscard]] CheckReport check_device(const CheckSettings& settings);

/// The pairs of points of a vector file, with every model that it has values for.
[[nodiscard]] CheckReport check_vectors(const CheckSettings& settings, const std::vector<VectorCase>& cases);

}  // namespace parian
