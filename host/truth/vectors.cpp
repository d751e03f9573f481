// Single pairs of points: right values in double, files of them, and what a device makes of them.
#include "truth/vectors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "kernels/bssrdf.h"
#include "render/self_test.hpp"
#include "scene/limits.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;
using kernels::real3;

constexpr double moved_by = 6e-8;  // of a vector's length: half a unit in the last place of float32

/// A pair in double; x = x_o - x_i.
struct Pair {
  glm::dvec3 x, w_i, n_i, n_o;
};

double exact_of(const Pair& pair, const kernels::ExactMedium& medium, const kernels::ExactBoundary& boundary,
                Model model) {
  const auto real = [](glm::dvec3 v) { return real3{v.x, v.y, v.z}; };
  const real3 w12 = kernels::refract_into(real(pair.w_i), real(pair.n_i), boundary);
  const kernels::DipoleGeometry g = kernels::dipole_geometry(real(pair.x), w12, real(pair.n_i), real(pair.n_o));
  return exact_bssrdf(model, medium, boundary, g);
}

Pair pair_of(const VectorCase& c) { return {glm::dvec3(c.x_o) - glm::dvec3(c.x_i), c.w_i, c.n_i, c.n_o}; }

/// A number, or text that holds a hexadecimal one; it must be finite.
std::optional<double> number(const Json& json) {
  double value = NAN;
  if (json.is_number()) value = json.get<double>();
  if (json.is_string()) {
    const auto& text = json.get_ref<const std::string&>();
    const bool minus = text.starts_with('-');
    std::string_view digits = std::string_view(text).substr(minus ? 1 : 0);
    const bool hexadecimal = digits.starts_with("0x") || digits.starts_with("0X");
    if (hexadecimal) digits.remove_prefix(2);
    const char* end = digits.data() + digits.size();
    const auto [stop, fault] =
        std::from_chars(digits.data(), end, value, hexadecimal ? std::chars_format::hex : std::chars_format::general);
    if (stop != end || fault != std::errc()) return {};
    if (minus) value = -value;
  }
  if (!std::isfinite(value)) return {};
  return value;
}

/// Reads one case; what is missing or isn't a number is named by the exception's text.
class CaseReader {
 public:
  CaseReader(const Json& json, std::string place) : json_(json), place_(std::move(place)) {}

  [[nodiscard]] float scalar(const char* key) const { return single(at(key), key); }
  [[nodiscard]] glm::vec3 vector(const char* key) const {
    const Json& v = at(key);
    if (!v.is_array() || v.size() != 3) fail(key, "is not an array of three numbers");
    return {single(v[0], key), single(v[1], key), single(v[2], key)};
  }
  /// Of `key`.directional and so on; NaN where there is none.
  [[nodiscard]] std::array<double, 3> by_model(const char* key) const {
    std::array<double, 3> values{VectorCase::unknown, VectorCase::unknown, VectorCase::unknown};
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (!json_.contains(key) || !json_[key].is_object() || !json_[key].contains(model_names[m])) continue;
      const std::optional<double> value = number(json_[key][model_names[m]]);
      if (!value || *value < 0) fail(key, fmt::format("has no number from 0 on for '{}'", model_names[m]));
      values[m] = *value;
    }
    return values;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw Error(ErrorKind::input,
                fmt::format("{}: '{}' {}; see the format of tests/data/vectors.json", place_, key, what));
  }

 private:
  [[nodiscard]] const Json& at(const char* key) const {
    if (!json_.is_object() || !json_.contains(key)) fail(key, "is missing");
    return json_[key];
  }
  [[nodiscard]] float single(const Json& json, const char* key) const {
    const std::optional<double> value = number(json);
    if (!value || !std::isfinite(static_cast<float>(*value))) fail(key, "is not a finite number");
    return static_cast<float>(*value);
  }
  const Json& json_;
  std::string place_;
};

double quantile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0;
  return sorted[static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size() - 1)))];
}

}  // namespace

double VectorCase::floor() const {
  const double sigma = channel.sigma_t_prime / (2 * std::numbers::pi);
  return 1e-9 * sigma * sigma;
}

double exact_bssrdf(const VectorCase& c, Model model) {
  return exact_of(pair_of(c), exact_medium(c.channel, model, 1), exact_boundary(c.channel), model);
}

double tolerance(const VectorCase& c, Model model) {
  const kernels::ExactMedium medium = exact_medium(c.channel, model, 1);
  const kernels::ExactBoundary boundary = exact_boundary(c.channel);
  const Pair pair = pair_of(c);
  const double S = exact_of(pair, medium, boundary, model);
  double kappa = 0;
  for (glm::dvec3 Pair::*v : {&Pair::x, &Pair::w_i, &Pair::n_i, &Pair::n_o})
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        Pair moved = pair;
        (moved.*v)[axis] += sign * moved_by * glm::length(pair.*v);
        kappa = std::max(kappa, std::fabs(exact_of(moved, medium, boundary, model) - S));
      }
  return 1e-4 * S + 16 * kappa + c.floor();
}

std::vector<VectorCase> random_vectors(std::size_t count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  const auto uniform = [&](double a, double b) { return a + (b - a) * (double(engine()) / 4294967296.0); };
  const auto log_uniform = [&](double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); };
  const auto on_cone = [&](double z) {
    const double phi = uniform(0, 2 * std::numbers::pi), s = std::sqrt(std::max(1 - z * z, 0.0));
    return glm::dvec3(s * std::cos(phi), s * std::sin(phi), z);
  };
  std::vector<VectorCase> cases(count);
  for (std::size_t i = 0; i < count; ++i) {
    VectorCase& c = cases[i];
    c.name = fmt::format("random {} of seed {}", i, seed);
    const double sigma = log_uniform(1e-6, 1e6), absorbed = log_uniform(1e-7, 1), g = uniform(-0.95, 0.99);
    c.sigma_s = static_cast<float>(sigma * (1 - absorbed) / (1 - g));
    c.sigma_a = static_cast<float>(sigma * absorbed);
    c.g = static_cast<float>(g);
    c.eta = static_cast<float>(log_uniform(1, 2.6));
    if (i % 8 == 5) c.eta = static_cast<float>(1 + log_uniform(1e-7, 0.1));
    if (i % 16 == 13) c.eta = 1;
    c.derive();
    const double r = log_uniform(1e-4, 300) / sigma;
    const glm::dvec3 w = on_cone(i % 4 == 3 ? log_uniform(1e-4, 0.1) : uniform(0, 1));
    const glm::dvec3 n = on_cone(uniform(-1, 1)),
                     helper = std::fabs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 t = glm::normalize(glm::cross(helper, n)), b = glm::cross(n, t);
    c.x_i = on_cone(uniform(-1, 1)) * uniform(0, r);
    c.x_o = glm::dvec3(c.x_i) + on_cone(uniform(-1, 1)) * r;
    c.w_i = t * w.x + b * w.y + n * w.z;
    c.n_i = n;
    c.n_o = on_cone(uniform(-1, 1));
    if (i % 2 == 0) {
      c.x_i = glm::vec3(0);
      c.x_o = on_cone(0) * r;
      c.w_i = w;
      c.n_i = c.n_o = glm::vec3(0, 0, 1);
    }
    for (std::size_t m = 0; m < models.size(); ++m) c.S[m] = exact_bssrdf(c, models[m]);
  }
  return cases;
}

std::vector<VectorCase> read_vectors(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::ifstream in(file);
  if (!in) throw Error(ErrorKind::input, name + ": can't be read; check the path");
  const Json json = Json::parse(in, nullptr, false);
  if (json.is_discarded()) throw Error(ErrorKind::input, name + ": isn't JSON; give a vector file");
  if (!json.is_object() || !json.contains("cases") || !json["cases"].is_array() || json["cases"].empty())
    throw Error(ErrorKind::input, name + ": has no array 'cases' with anything in it; give a vector file");
  std::vector<VectorCase> cases;
  for (const Json& j : json["cases"]) {
    VectorCase c;
    c.name = fmt::format("case {}", cases.size());
    if (j.is_object() && j.contains("name") && j["name"].is_string()) c.name = j["name"].get<std::string>();
    const CaseReader read(j, fmt::format("{}: {}", name, c.name));
    c.sigma_s = read.scalar("sigma_s"), c.sigma_a = read.scalar("sigma_a");
    c.g = read.scalar("g"), c.eta = read.scalar("eta");
    c.x_i = read.vector("x_i"), c.w_i = read.vector("w_i"), c.n_i = read.vector("n_i");
    c.x_o = read.vector("x_o"), c.n_o = read.vector("n_o");
    c.S = read.by_model("S"), c.tol = read.by_model("tol");
    const double sigma_s = c.sigma_s, sigma_a = c.sigma_a, g = c.g, eta = c.eta;
    validate({c.name, glm::dvec3(sigma_s), glm::dvec3(sigma_a), glm::dvec3(g), eta},
             fmt::format("{}: {}", name, c.name));
    c.derive();
    cases.push_back(c);
  }
  return cases;
}

std::string vector_json(const VectorCase& c) {
  const auto hex = [](double x) { return fmt::format("{:a}", x); };
  const auto vector = [&](glm::vec3 v) { return Json{hex(v.x), hex(v.y), hex(v.z)}; };
  Json json{{"name", c.name},       {"sigma_s", hex(c.sigma_s)}, {"sigma_a", hex(c.sigma_a)}, {"g", hex(c.g)},
            {"eta", hex(c.eta)},    {"x_i", vector(c.x_i)},      {"w_i", vector(c.w_i)},      {"n_i", vector(c.n_i)},
            {"x_o", vector(c.x_o)}, {"n_o", vector(c.n_o)},      {"S", Json::object()},       {"tol", Json::object()}};
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (!std::isnan(c.S[m])) json["S"][model_names[m]] = hex(c.S[m]);
    if (!std::isnan(c.tol[m])) json["tol"][model_names[m]] = hex(c.tol[m]);
  }
  return json.dump();
}

std::vector<float> device_bssrdf(Compute& compute, const std::vector<VectorCase>& cases, Model model,
                                 std::uint32_t lanes, const std::string& source) {
  compute.build(self_test_options(model, lanes), source);
  const std::size_t stride = (cases.size() + lanes - 1) / lanes * lanes;
  std::vector<kernels::Medium> media;
  std::vector<kernels::Boundary> boundaries;
  std::vector<float> vectors(15 * stride);
  for (std::size_t i = 0; i < stride; ++i) {
    const VectorCase& c = cases[std::min(i, cases.size() - 1)];  // lanes beyond the last repeat it
    media.push_back(device_medium(c.channel, model, 1));
    boundaries.push_back(device_boundary(exact_boundary(c.channel)));
    const std::array<glm::vec3, 5> of_pair{c.x_i, c.w_i, c.n_i, c.x_o, c.n_o};
    for (std::size_t k = 0; k < 15; ++k) vectors[k * stride + i] = of_pair[k / 3][static_cast<int>(k % 3)];
  }
  cl::Buffer m = compute.upload(media), b = compute.upload(boundaries), v = compute.upload(vectors);
  cl::Buffer S = compute.upload(std::vector<float>(stride, NAN));
  compute.launch("self_test_pairs", stride / lanes, Stage::plan, m, b, v, static_cast<cl_uint>(stride), S);
  std::vector<float> result = compute.read<float>(S, cases.size());
  for (cl::Buffer* buffer : {&m, &b, &v, &S}) compute.release(*buffer);
  return result;
}

Judgement judge(const std::vector<VectorCase>& cases, const std::vector<float>& S, Model model) {
  const auto of_model = static_cast<std::size_t>(model);
  Judgement result;
  std::vector<double> relative;
  const auto take = [&](std::size_t i, double of_tol) {
    result.outside += of_tol > 1;
    if (of_tol <= result.worst_of_tol) return;
    result.worst_of_tol = of_tol;
    result.worst = i;
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const VectorCase& c = cases[i];
    const double right = c.S[of_model];
    if (std::isnan(right)) continue;
    ++result.cases;
    if (!std::isfinite(S[i]) || S[i] < 0) {
      ++result.bad;
      take(i, INFINITY);
      continue;
    }
    const double floor = c.floor(), error = std::fabs(double{S[i]} - right);
    if (right > floor) relative.push_back(error / right);
    double tol = c.tol[of_model];
    if (std::isnan(tol)) {
      tol = 1e-4 * right + floor;  // kappa takes 25 times as long and only adds to it
      if (error > std::min(1.0, result.worst_of_tol) * tol) tol = tolerance(c, model);
    }
    take(i, error > 0 ? error / tol : 0);
  }
  std::sort(relative.begin(), relative.end());
  result.median = quantile(relative, 0.5);
  result.p999 = quantile(relative, 0.999);
  if (!relative.empty()) result.worst_relative = relative.back();
  return result;
}

}  // namespace parian
