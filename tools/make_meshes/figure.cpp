// The swan's anatomy; figure.h says what it is. Local axes: the swan looks along +z, its left side is +x.
#include "figure.h"

#include <algorithm>
#include <numbers>

namespace make_meshes {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kYaw = 24.0 * kDegree;  // the whole figure is turned towards +x by this
constexpr double kScale = 0.93;          // from the lengths below to those of the model
constexpr double kWater = 9.0;           // height of the plinth's top
constexpr double kLayer = 0.8;           // fillet between feathers

dvec3 turn(dvec3 p) {  // world to local
  const double c = std::cos(kYaw), s = std::sin(kYaw);
  return {c * p.x - s * p.z, p.y, s * p.x + c * p.z};
}

double mix(double a, double b, double t) { return a + t * (b - a); }

Tube make_neck() {
  return Tube({{0, 21, 12, 11.5},
               {0, 27, 22, 9.5},
               {-1, 37, 30, 6.8},
               {-5, 49, 31, 5.2},
               {-10, 60, 24, 4.6},
               {-12, 71, 15, 4.2},
               {-9, 81, 12, 3.9},
               {-3.5, 83.5, 16.5, 3.7},
               {0, 80, 21, 3.7}});
}

}  // namespace

Figure::Figure() : neck_(make_neck()) {
  const dvec4 top = neck_.at(1.0);
  head_ = look_along(dvec3(top), dvec3(0.54, -0.62, 0.60), dvec3(0, 1, 0));
  wings_.push_back(make_wing(1.0, 18.0 * kDegree, 58.0 * kDegree));
  wings_.push_back(make_wing(-1.0, 15.0 * kDegree, 54.0 * kDegree));
  make_tail();
}

void Figure::make_tail() {
  for (int i = -4; i <= 4; ++i) {
    const double a = i / 4.0;
    Feather f;
    f.base = {5.0 * a, 25.0 - 1.5 * a * a, -20.0};
    f.tip = f.base + glm::normalize(dvec3(0.5 * a, 0.26 - 0.1 * a * a, -1.0)) * (24.0 - 6.0 * a * a);
    f.normal = {0.35 * a, 1.0, 0.4};
    f.half_width = 3.6;
    f.thickness = 1.9;
    f.bend = -1.5;
    f.prepare();
    tail_.push_back(f);
  }
}

// The arm's bones in the sheet of a wing, and its radius there.
const dvec3 kBones[] = {{-6, 2, 5.5},  {3, -3, 5.0},    {13, -7.5, 4.0}, {24, -9.5, 3.3},
                        {34, -8, 2.8}, {42, -3.5, 2.2}, {50, 2, 1.4}};
// Where feathers have their roots, in the sheet: a little behind the arm.
const dvec4 kRoots[] = {{-3, 0, 0, 1},  {5, -3, 0, 1},    {14, -6.5, 0, 1}, {24, -8.5, 0, 1},
                        {34, -7, 0, 1}, {42, -2.5, 0, 1}, {49, 3, 0, 1}};

Figure::Wing Figure::make_wing(double side, double lift, double sweep) {
  const dvec3 shoulder{side * 11.5, 31.0, 4.5};
  const dvec3 up = glm::normalize(dvec3(side * std::sin(lift), std::cos(lift), -0.12));
  dvec3 back{side * std::sin(sweep), 0.0, -std::cos(sweep)};
  back = glm::normalize(back - glm::dot(back, up) * up);
  dvec3 out = glm::cross(back, up);
  if (out.z < 0.0) out = -out;  // the face that looks forward
  // The sheet in which feathers lie: cupped forward at its edges.
  const auto sheet = [&](dvec2 q, double n) {
    const double cup = 0.0035 * q.x * q.x + 0.0045 * q.y * q.y;
    return shoulder + q.x * up + q.y * back + (n + cup - 2.0) * out;
  };
  std::vector<dvec4> arm;
  for (const dvec3 bone : kBones) arm.push_back(dvec4(sheet(dvec2(bone), 0.0), bone.z));
  const Tube roots({std::begin(kRoots), std::end(kRoots)});
  Wing wing{Tube(arm), {}};

  struct Row {
    int count;
    double reach;  // share of a flight feather's length
    double width, rise, thickness;
  };
  // Flight feathers, then coverts: three rows in front of them, two behind.
  const Row rows[] = {{23, 1.00, 4.0, 0.0, 1.7}, {22, 0.60, 3.7, 1.1, 1.6},  {21, 0.40, 3.3, 2.0, 1.6},
                      {20, 0.24, 2.8, 2.7, 1.6}, {20, 0.55, 3.7, -1.1, 1.6}, {19, 0.30, 3.2, -2.0, 1.6}};
  for (const Row& row : rows) {
    for (int i = 0; i < row.count; ++i) {
      const bool flight = row.reach == 1.0;
      const double s = (i + (row.count % 2 ? 0.0 : 0.5)) / 22.0;  // along the arm; even rows are staggered
      const dvec2 root(roots.at(s));
      const double angle = (106.0 - 46.0 * s - 56.0 * s * s * s) * kDegree;
      const double full = mix(24.0, 33.0, smooth_step(0.0, 0.6, s)) + 6.0 * std::sin(std::numbers::pi * s * s);
      const dvec2 along{std::cos(angle), std::sin(angle)};
      const double length = full * row.reach * (flight ? 1.0 : 1.0 - 0.3 * s * s);
      Feather f;
      f.base = sheet(root + (flight ? -1.5 : 1.0) * along, 0.4 * row.rise);
      f.tip = sheet(root + length * along, row.rise);
      // Tilted, so that each lies over the next like a tile.
      f.normal = glm::normalize(out + 0.22 * (along.y * up - along.x * back) * (row.rise < 0 ? -1.0 : 1.0));
      f.half_width = row.width * (1.0 + 0.1 * s);
      f.thickness = row.thickness;
      f.shaft = flight ? 0.5 : 0.15;
      f.bend = -0.05 * length;
      f.sickle = side * (flight ? 0.05 : 0.02) * length;
      f.roundness = mix(2.6, 2.0, s);
      f.prepare();
      wing.feathers.push_back(f);
    }
  }
  wing.enclose(sheet({30, 15}, 0.0));
  return wing;
}

void Figure::Wing::enclose(dvec3 middle) {
  centre = middle;
  for (const Feather& f : feathers)
    radius = std::max({radius, glm::length(f.tip - centre), glm::length(f.base - centre)});
  radius += 8.0;
}

double Figure::Wing::distance(dvec3 p) const {
  const double outside = glm::length(p - centre) - radius;
  if (outside > 8.0) return outside;
  double d = arm.distance(p);
  for (const Feather& f : feathers) {
    if (f.bound(p) < d + kLayer) d = smooth_min(d, f.distance(p), kLayer);
  }
  return d;
}

double Figure::body(dvec3 p) const {
  const dvec3 q{std::abs(p.x), p.y, p.z};
  double d = ellipsoid(p - dvec3(0, 19.5, 1), {17.5, 14.5, 25});             // trunk
  d = smooth_min(d, ellipsoid(p - dvec3(0, 21, 13), {14, 13.5, 15}), 8.0);   // breast
  d = smooth_min(d, ellipsoid(q - dvec3(8, 23, -6), {9.5, 10, 18}), 6.0);    // haunches under the folded back
  d = smooth_min(d, ellipsoid(p - dvec3(0, 24, -23), {8.0, 4.2, 12}), 9.0);  // rump
  d = smooth_min(d, neck_.distance(p), 6.0);
  for (const Wing& wing : wings_) d = smooth_min(d, wing.arm.distance(p), 6.0);
  for (const Feather& f : tail_) {
    if (f.bound(p) < d + 1.0) d = smooth_min(d, f.distance(p), 0.7);
  }
  return d;
}

double Figure::head(dvec3 p) const {
  const dvec3 q = head_.to_local(p);
  const double bound = glm::length(q) - 20.0;
  if (bound > 4.0) return bound;
  const dvec3 m{std::abs(q.x), q.y, q.z};
  double d = ellipsoid(q - dvec3(0, 0.8, 2.2), {4.1, 4.4, 6.0});                  // skull
  d = smooth_min(d, ellipsoid(m - dvec3(1.6, -0.9, 4.0), {2.5, 2.7, 4.0}), 1.5);  // cheeks
  // Bill: flat and broad towards its end, with the knob of a mute swan at its root.
  const double z = std::clamp((q.z - 5.5) / 11.5, 0.0, 1.0);
  const dvec3 axis{0.0, mix(0.4, -1.5, z), std::clamp(q.z, 5.5, 14.2)};
  const dvec3 o = q - axis;
  const double wide = mix(2.7, 2.35, z), high = mix(2.9, 1.35, smooth_step(0.0, 0.9, z));
  const double bill = ellipsoid(o, {wide, high, 2.2});
  d = smooth_min(d, bill, 1.2);
  d = smooth_min(d, ellipsoid(q - dvec3(0, 3.0, 7.4), {1.5, 1.4, 1.9}), 1.2);  // knob
  const double mouth = std::hypot(q.y - mix(-0.7, -2.0, z), 0.6 * std::max(0.0, 5.5 - q.z)) - 0.2;
  d = smooth_max(d, -mouth, 0.5);
  const double lore = std::abs(q.z - 6.6 + 0.45 * (q.y - 1.0)) - 0.05;  // where bill and face meet
  d += 0.22 * std::exp(-lore * lore / 0.12) * smooth_step(-2.0, -0.4, q.y);
  d = smooth_max(d, -ellipsoid(m - dvec3(1.35, 1.25, 10.4), {0.6, 0.5, 1.0}), 0.4);  // nostrils
  const dvec3 e = m - dvec3(3.3, 1.5, 4.7);
  d = smooth_max(d, -ellipsoid(e - dvec3(0.5, 0, 0.45), {1.1, 0.85, 1.35}), 0.7);  // socket, an almond
  d = smooth_min(d, glm::length(e + dvec3(0.8, 0, 0)) - 1.3, 0.25);                // eye
  return d;
}

double Figure::plinth(dvec3 p) const {
  const double r = std::hypot(p.x, p.z);
  const double wave = ellipsoid({p.x, 0.0, p.z - 1.0}, {16.0, 10.0, 23.0});
  const double ripple = 0.6 * std::cos(wave * 2.0 * std::numbers::pi / 6.2) * std::exp(-wave * wave / 420.0) *
                        (1.0 - smooth_step(30.0, 36.0, r));
  // A disc with a cavetto round its waist.
  double d = smooth_max(r - 38.0, std::abs(p.y - 0.5 * kWater) - 0.5 * kWater, 3.0);
  d -= ripple * smooth_step(kWater - 4.0, kWater - 0.5, p.y);
  const double groove = std::hypot(r - 40.2, p.y - 4.4) - 3.6;
  return 0.9 * smooth_max(d, -groove, 2.0);
}

double Figure::distance(dvec3 world) const {
  const dvec3 p = turn(world / kScale);
  double d = smooth_min(body(p), head(p), 2.0);
  for (const Wing& wing : wings_) d = smooth_min(d, wing.distance(p), 1.2);
  d = smooth_min(d, plinth(p), 2.2);
  return kScale * d;
}

double Figure::detail(dvec3 world) const {
  const dvec3 p = turn(world / kScale);
  return mix(0.5, 1.0, smooth_step(9.0, 16.0, glm::length(p - head_.origin - 5.0 * head_.z)));
}

}  // namespace make_meshes
