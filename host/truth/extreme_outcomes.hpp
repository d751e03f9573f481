// The documented outcomes of extreme cases, as things to run: a refusal, a right value, a picture that doesn't change.
#pragma once
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "truth/trial.hpp"

namespace parian {

/// What a case changes of the ordinary scene and settings.
using Change = std::function<void(Scene&, Settings&)>;
using Outcome = std::function<Finding(Trial&)>;

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
/// Of pictures that differ by rounding alone: pixels at silhouettes may change which of 64 positions they count.
inline constexpr double rounding_relmse = 1e-6;

/// Renders the ordinary scene, changed.
[[nodiscard]] Trial::Result changed(Trial& trial, const Change& change);

/// `f` throws an Error whose text has all `words`.
[[nodiscard]] Finding refused(const std::function<void()>& f, const std::vector<std::string>& words);
/// The plan of the changed scene is refused so.
[[nodiscard]] Outcome refuses(const Change& change, const std::vector<std::string>& words);
/// S_d of a material is as in double; its picture is finite, and not black unless it `may_be_black`; and a warning has
/// `words`.
[[nodiscard]] Outcome renders(const Material& material, const std::string& words = "", bool may_be_black = false);
/// The changed scene's picture is the ordinary one's: to the bit, or within a relMSE.
[[nodiscard]] Outcome changes_nothing(const Change& change, double relmse = 0);
/// Every pixel of the changed scene is covered by the object, all of it.
[[nodiscard]] Outcome covers_film(const Change& change);

/// What fails of two findings, else the one that takes more of what it allows.
[[nodiscard]] Finding both(const Finding& a, const Finding& b);
[[nodiscard]] Finding warned(const Trial::Result& result, const std::string& words);
[[nodiscard]] Finding not_black(const Trial::Result& result);
/// Of R, G and B over the whole film.
[[nodiscard]] double mean_of(const Image& image);

}  // namespace parian
