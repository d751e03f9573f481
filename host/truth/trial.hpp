// Small scenes made by code, and a device to try them on.
#pragma once
#include <memory>
#include <string>

#include "truth/vectors.hpp"

namespace parian {

/// What a case came to. It passes when `error` is at most `allowed`; NaN doesn't.
struct Finding {
  double error = 0, allowed = 0;
  std::string what;  ///< what the error is of, or what a refusal said
  [[nodiscard]] bool passed() const { return error <= allowed; }
};

/// The coefficients of all channels alike, 1/mm.
[[nodiscard]] Material medium_of(double sigma_s, double sigma_a, double g = 0.0, double ior = 1.3);

/// A sphere of six grids of n x n quads pushed out to `radius` mm around the origin, cleaned; n a power of two.
[[nodiscard]] Mesh sphere_mesh(double radius = 50.0, int n = 8);
/// A square plate in the plane z = 0 with sides of 2 `half` mm, as n x n quads.
[[nodiscard]] Mesh plate_mesh(double half = 50.0, int n = 4);

/// A sphere of 100 mm in a material with three different channels, the densest last, lit obliquely from the front, on a
/// film of 16 x 16. Cases change one thing of it.
[[nodiscard]] Scene ordinary_scene();
/// One frame's worth, every pixel computed for itself. Nothing that would change the program is left out, so that most
/// cases share one.
[[nodiscard]] Settings ordinary_settings();

/// One device, what its picture of the ordinary scene is, and how it evaluates S_d.
class Trial {
 public:
  explicit Trial(const std::string& selector);

  struct Result {
    Image image;
    Statistics statistics;
  };
  /// One frame of a scene. Throws std::runtime_error when a value of the picture isn't finite, is negative, or lies off
  /// the object, and Error as Rendering does.
  [[nodiscard]] Result render(const Scene& scene, const Settings& settings) const;
  /// The ordinary scene with the ordinary settings, rendered once.
  [[nodiscard]] const Result& ordinary();
  /// Worst error over its tolerance of S_d in float32, over pairs from 0 to 100 mean free paths apart, all channels.
  [[nodiscard]] Finding bssrdf(const Material& material);

  [[nodiscard]] const DeviceInfo& device() const { return compute_.info(); }

 private:
  std::string selector_;
  Compute compute_;
  std::uint32_t lanes_ = 1;
  std::unique_ptr<Result> ordinary_;
};

/// Values of RGBA that differ in bits; none are allowed.
[[nodiscard]] Finding same_bits(const Image& picture, const Image& expected);
/// relMSE of the picture against what it should be, with the root of `allowed` allowed in each pixel on average.
[[nodiscard]] Finding same_picture(const Image& picture, const Image& expected, double allowed);
/// The largest of R, G and B; only 0 is allowed.
[[nodiscard]] Finding black(const Image& picture);

}  // namespace parian
