// Tubes and feathers; shapes.h says what they are.
#include "shapes.h"

#include <algorithm>

namespace make_meshes {

Frame look_along(dvec3 origin, dvec3 forward, dvec3 up) {
  const dvec3 z = glm::normalize(forward);
  const dvec3 x = glm::normalize(glm::cross(up, z));
  return {origin, x, glm::cross(z, x), z};
}

namespace {

constexpr int kSamplesPerSpan = 6;

// Position of a uniform cubic B-spline's span, u from 0 to 1, and its derivative.
dvec4 position(const dvec4* c, double u) {
  const double v = 1.0 - u;
  return (v * v * v * c[0] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * c[1] +
          (-3.0 * u * u * u + 3.0 * u * u + 3.0 * u + 1.0) * c[2] + u * u * u * c[3]) /
         6.0;
}

dvec4 derivative(const dvec4* c, double u) {
  const double v = 1.0 - u;
  return 0.5 * (-v * v * c[0] + (3.0 * u * u - 4.0 * u) * c[1] + (-3.0 * u * u + 2.0 * u + 1.0) * c[2] + u * u * c[3]);
}

// One of the two at t, which counts spans.
dvec4 spline(const std::vector<dvec4>& controls, double t, dvec4 (*what)(const dvec4*, double) = position) {
  const int spans = static_cast<int>(controls.size()) - 3;
  const int i = std::clamp(static_cast<int>(t), 0, spans - 1);
  return what(controls.data() + i, t - i);
}

}  // namespace

Tube::Tube(std::vector<dvec4> controls) : controls_(std::move(controls)) {
  // Repeated end points make the curve start and end at the first and last control.
  controls_.insert(controls_.begin(), 2, controls_.front());
  controls_.insert(controls_.end(), 2, controls_.back());
  const int count = (static_cast<int>(controls_.size()) - 3) * kSamplesPerSpan;
  for (int i = 0; i <= count; ++i) {
    samples_.push_back(spline(controls_, static_cast<double>(i) / kSamplesPerSpan));
    centre_ += dvec3(samples_.back()) / (count + 1.0);
  }
  for (const dvec4& s : samples_) bound_ = std::max(bound_, glm::length(dvec3(s) - centre_) + s.w);
}

dvec4 Tube::at(double t) const { return spline(controls_, t * (static_cast<double>(controls_.size()) - 3.0)); }

double Tube::nearest(dvec3 p) const {
  std::size_t best = 0;
  double best_distance = 1e300;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const dvec3 d = p - dvec3(samples_[i]);
    const double distance = glm::dot(d, d);
    if (distance < best_distance) best_distance = distance, best = i;
  }
  const double spans = static_cast<double>(controls_.size()) - 3.0;
  const double low = std::max(0.0, (static_cast<double>(best) - 1.0) / kSamplesPerSpan);
  const double high = std::min(spans, (static_cast<double>(best) + 1.0) / kSamplesPerSpan);
  double t = static_cast<double>(best) / kSamplesPerSpan;
  for (int i = 0; i < 5; ++i) {  // Gauss-Newton on (c(t) - p) . c'(t) = 0
    const dvec3 c1 = spline(controls_, t, derivative);
    const double slope = glm::dot(c1, c1);
    if (slope < 1e-9) break;
    t = std::clamp(t - glm::dot(dvec3(spline(controls_, t)) - p, c1) / slope, low, high);
  }
  return t / spans;
}

double Tube::distance(dvec3 p) const {
  const double outside = glm::length(p - centre_) - bound_;
  if (outside > 6.0) return outside;
  const dvec4 c = at(nearest(p));
  return glm::length(p - dvec3(c)) - c.w;
}

void Feather::prepare() {
  frame_ = look_along(base, tip - base, normal);
  length_ = glm::length(tip - base);
  centre_ = 0.5 * (base + tip) + 0.5 * bend * frame_.y + 0.5 * sickle * frame_.x;
  radius_ = 0.5 * length_ + half_width + thickness + std::abs(bend) + std::abs(sickle);
}

double Feather::distance(dvec3 p) const {
  const dvec3 q = frame_.to_local(p);
  const double u = std::clamp(q.z / length_, -0.1, 1.0);
  const double arch = 4.0 * u * (1.0 - u);
  const double across = q.x - sickle * arch;
  const double above = q.y - bend * arch;
  // Outline: widens from the base to 60 % of the length, then closes in a superellipse.
  constexpr double kShoulder = 0.6;
  double width = half_width;
  double past = 0.0;
  if (u < kShoulder) {
    width *= 0.55 + 0.45 * smooth_step(-0.1, kShoulder, u);
    past = std::max(0.0, -q.z);
  }
  const double cap = length_ * (1.0 - kShoulder);
  double outline;
  if (q.z > length_ * kShoulder) {
    const double a = std::abs(across) / half_width;
    const double b = (q.z - length_ * kShoulder) / cap;
    const double e = roundness;
    const double f = std::pow(std::pow(a, e) + std::pow(b, e), 1.0 / e);
    const double ga = f > 1e-9 ? std::pow(a / f, e - 1.0) / half_width : 1.0 / half_width;
    const double gb = f > 1e-9 ? std::pow(b / f, e - 1.0) / cap : 0.0;
    outline = (f - 1.0) / std::max(std::hypot(ga, gb), 1.0 / cap);
  } else {
    outline = std::hypot(std::max(std::abs(across) - width, 0.0), past) + std::min(std::abs(across) - width, 0.0);
  }
  // Section: thinner towards the edges, with the shaft proud of both faces.
  const double r = across / std::max(width, 1e-6);
  const double beside = across / 0.85;
  const double fade = 1.0 - 0.6 * std::clamp(u, 0.0, 1.0);
  const double half = 0.5 * thickness * (1.0 - 0.3 * std::min(r * r, 1.0)) + shaft * fade * std::exp(-beside * beside);
  return smooth_max(outline + 0.1, std::abs(above) - half, 1.2);
}

}  // namespace make_meshes
