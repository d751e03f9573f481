// From the film's halves to the image and to its estimated error; the definitions are in docs/method.md.
#pragma once
#include <glm/glm.hpp>
#include <vector>

namespace parian {

/// Halves A and B of one image at one level of the layers, per pixel, premultiplied by coverage.
struct Halves {
  std::vector<glm::vec3> a, b;
  std::vector<float> alpha;
};

/// What an image should show, going by the scene.
struct Expected {
  bool object = false;  ///< the middle of the object lies in the film
  bool light = false;   ///< light falls on what scatters it
};

/// Estimated relMSE of an image at some level, going by the same one at level 0 (A0, B0): the mean over pixels with
/// alpha >= 0.999 and over RGB of ((A-B)^2/4 + (A-A0)(B-B0)) / (C^2+eps^2), C = (A+B)/2, eps = 0.01 x mean of C; the
/// mean of the second term, a squared blur, counts as at least 0. The result is 0 where nothing is covered or all is
/// black and that is as expected, -1 (not known) where it is not or only edges are covered, and infinite where a value
/// is not finite.
[[nodiscard]] double estimated_relmse(const Halves& h, const Halves& finest, const Expected& expected = {});

/// Pixels of an image whose light was also computed at their own points, and by how much the layers differ from that.
struct PixelDifferences {
  std::vector<std::size_t> pixels;
  std::vector<glm::vec3> a, b;  ///< A0 - A' and B0 - B' of each
};

/// Estimated relMSE that looking light up in layers adds: the mean over the pixels and RGB of
/// (A0-A')(B0-B') / (C^2+eps^2), C and eps those of the whole image, at least 0; -1 (not known) without pixels or where
/// all is black that shouldn't be, and infinite where a value is not finite.
[[nodiscard]] double estimated_bias_relmse(const Halves& h, const PixelDifferences& d, const Expected& expected = {});

}  // namespace parian
