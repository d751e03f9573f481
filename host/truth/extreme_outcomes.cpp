// What the outcomes of extreme cases measure.
#include "truth/extreme_outcomes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/words.hpp"
#include "plan/plan.hpp"

namespace parian {

Trial::Result changed(Trial& trial, const Change& change) {
  Scene scene = ordinary_scene();
  Settings settings = ordinary_settings();
  change(scene, settings);
  return trial.render(scene, settings);
}

Finding refused(const std::function<void()>& f, const std::vector<std::string>& words) {
  try {
    f();
  } catch (const Error& error) {
    const std::string text = in_command_words(error.what());
    for (const std::string& word : words)
      if (text.find(word) == std::string::npos) return {inf, 0, fmt::format("refused without '{}': {}", word, text)};
    return {0, 0, "refused: " + text};
  }
  return {inf, 0, "not refused"};
}

Outcome refuses(const Change& change, const std::vector<std::string>& words) {
  return [=](Trial& trial) {
    Scene scene = ordinary_scene();
    Settings settings = ordinary_settings();
    change(scene, settings);
    return refused([&] { (void)make_plan(scene, settings, trial.device()); }, words);
  };
}

Finding both(const Finding& a, const Finding& b) {
  if (!a.passed() || !b.passed()) return a.passed() ? b : a;
  Finding worse = a.allowed > 0 && (b.allowed == 0 || a.error / a.allowed > b.error / b.allowed) ? a : b;
  if (!a.what.empty() && a.what != b.what) worse.what = a.what + "; " + b.what;
  return worse;
}

Finding warned(const Trial::Result& result, const std::string& words) {
  for (const std::string& warning : result.statistics.warnings)
    if (warning.find(words) != std::string::npos) return {0, 0, "warns of it"};
  return {inf, 0, fmt::format("no warning has '{}'", words)};
}

Finding not_black(const Trial::Result& result) {
  return black(result.image).passed() ? Finding{inf, 0, "the picture is black"} : Finding{0, 0, "picture finite"};
}

double mean_of(const Image& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i)
    if (i % 4 < 3) sum += double{image.rgba[i]};
  return sum / (0.75 * static_cast<double>(image.rgba.size()));
}

Outcome renders(const Material& material, const std::string& words, bool may_be_black) {
  return [=](Trial& trial) {
    const Trial::Result result = changed(trial, [&](Scene& scene, Settings&) { scene.material = material; });
    Finding picture = may_be_black ? Finding{0, 0, "picture finite"} : not_black(result);
    if (!words.empty()) picture = both(picture, warned(result, words));
    return picture.passed() ? trial.bssrdf(material) : picture;
  };
}

Outcome changes_nothing(const Change& change, double relmse) {
  return [=](Trial& trial) {
    const Image image = changed(trial, change).image;
    const Image& expected = trial.ordinary().image;
    return relmse > 0 ? same_picture(image, expected, relmse) : same_bits(image, expected);
  };
}

Outcome covers_film(const Change& change) {
  return [=](Trial& trial) {
    const Image image = changed(trial, change).image;
    double open = 0;
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) open += image.rgba[i] != 1.0F;
    return Finding{open, 0, "pixels not covered whole"};
  };
}

}  // namespace parian
