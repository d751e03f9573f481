// What callers of the C API give, checked, as the library's own types; and what they are given.
#pragma once
#include <parian/parian.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "core/compute.hpp"
#include "core/embedded.hpp"
#include "core/error.hpp"
#include "render/renderer.hpp"
#include "scene/mesh.hpp"
#include "scene/scene.hpp"

namespace parian {

/// Throws Error(usage): the caller's mistake, in words that name the argument and the remedy.
[[noreturn]] void refuse(const std::string& what);

/// What the caller gave, with zeros for what his header doesn't have yet.
template <class T>
T taken(const T* given, const char* what) {
  if (!given) refuse(fmt::format("{}: it is NULL; give a struct", what));
  std::size_t size = 0;
  std::memcpy(&size, given, sizeof size);
  if (size < 2 * sizeof(size_t) || size > 64 * sizeof(T))
    refuse(fmt::format("{}: struct_size is {}, sizeof is {}; set it to sizeof the struct", what, size, sizeof(T)));
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < size; ++i)
    if (bytes[i])
      refuse(fmt::format("{}: it has fields that version {} doesn't know; use a newer library", what, version));
  T full{};
  std::memcpy(&full, given, std::min(size, sizeof(T)));
  return full;
}

/// Fills the part of a struct that the caller knows; what only a newer header has is 0.
template <class T>
void give(T* wanted, T full, const char* what) {
  if (!wanted) refuse(fmt::format("{}: it is NULL; give a struct", what));
  const std::size_t size = wanted->struct_size;
  if (size < 2 * sizeof(size_t) || size > 64 * sizeof(T))
    refuse(fmt::format("{}: struct_size is {}, sizeof is {}; set it to sizeof the struct", what, size, sizeof(T)));
  full.struct_size = size;
  std::memset(wanted, 0, size);
  std::memcpy(wanted, &full, std::min(size, sizeof(T)));
}

[[nodiscard]] inline glm::dvec3 vec3(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// An enumeration of the API as one of the library's. What isn't one of its values may not be looked at as one.
template <class T, class Given>
T one_of(const Given& given, const char* what) {
  int value = 0;
  static_assert(sizeof value == sizeof given);
  std::memcpy(&value, &given, sizeof value);
  if (value < 0 || value > 2) refuse(fmt::format("{}: {} is none of its values, 0 to 2", what, value));
  return static_cast<T>(value);
}

/// A buffer of the context that `compute` has, retained.
[[nodiscard]] cl::Buffer buffer_of(const Compute& compute, cl_mem handle, const char* what);

/// Refuses a buffer that doesn't hold `count` pieces of `bytes`, `stride` bytes apart.
void require_bytes(const cl::Buffer& b, std::size_t offset, std::size_t count, std::size_t stride, std::size_t bytes,
                   const char* what);

/// A mesh in host memory. Throws Error(input) for what no picture can be made with.
[[nodiscard]] Mesh host_mesh(const parian_mesh& m);

/// A mesh in the caller's buffers.
[[nodiscard]] DeviceMesh device_mesh(const Compute& compute, const parian_mesh& m);

[[nodiscard]] Settings settings_of(const parian_settings& s);

}  // namespace parian
