// Signed distance functions from which figures are built: smooth unions, ellipsoids, tubes along splines, feathers.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <vector>

namespace make_meshes {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

// Polynomial smooth minimum: fillets of about k where two shapes meet, the plain minimum elsewhere.
inline double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * h * k / 6.0;
}

inline double smooth_max(double a, double b, double k) { return -smooth_min(-a, -b, k); }

inline double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Distance to an axis-aligned ellipsoid, exact to first order near its surface.
inline double ellipsoid(dvec3 p, dvec3 radii) {
  const double k0 = glm::length(p / radii);
  const double k1 = glm::length(p / (radii * radii));
  return k1 < 1e-12 ? -std::min({radii.x, radii.y, radii.z}) : k0 * (k0 - 1.0) / k1;
}

// A right-handed frame: to_local() gives coordinates along its axes.
struct Frame {
  dvec3 origin, x, y, z;
  dvec3 to_local(dvec3 p) const {
    const dvec3 d = p - origin;
    return {glm::dot(d, x), glm::dot(d, y), glm::dot(d, z)};
  }
};

// Frame at origin whose z axis points along forward and whose y axis is as close to up as it can be.
Frame look_along(dvec3 origin, dvec3 forward, dvec3 up);

// A round tube along a uniform cubic B-spline; w of a control point is the radius there.
class Tube {
 public:
  explicit Tube(std::vector<dvec4> controls);
  double distance(dvec3 p) const;
  dvec4 at(double t) const;       // t from 0 to 1; position and radius
  double nearest(dvec3 p) const;  // parameter of the nearest point of the axis

 private:
  std::vector<dvec4> controls_;
  std::vector<dvec4> samples_;
  dvec3 centre_{0.0};
  double bound_ = 0.0;
};

// A feather: a thin blade with a shaft, bent along its length and across its face.
struct Feather {
  dvec3 base, tip;
  dvec3 normal;  // of the blade's upper face; made orthogonal to the blade by prepare()
  double half_width = 4.0;
  double thickness = 1.7;  // in the middle, without the shaft
  double shaft = 0.15;     // how far the shaft stands out at the base
  double bend = 0.0;       // how far the middle rises above the chord
  double sickle = 0.0;     // how far the middle lies sideways of the chord
  double roundness = 2.5;  // of the tip: 2 an ellipse, more is blunter

  void prepare();
  double distance(dvec3 p) const;
  double bound(dvec3 p) const { return glm::length(p - centre_) - radius_; }

 private:
  Frame frame_{};
  dvec3 centre_{0.0};
  double length_ = 1.0, radius_ = 1.0;
};

}  // namespace make_meshes
