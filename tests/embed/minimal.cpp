// From a mesh in memory to an image: the shortest way, in C++. Writes the image as PFM if an argument says where.
#include <parian/parian.hpp>

#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <vector>

#include "torus.h"

int main(int argc, char** argv) try {
  constexpr std::uint32_t width = 96, height = 64;
  std::vector<float> positions(3 * TORUS_POSITIONS);
  std::vector<std::uint32_t> indices(3 * TORUS_TRIANGLES);
  torus_positions(positions.data(), 14.0F);
  torus_indices(indices.data());

  parian::Renderer renderer(std::getenv("PARIAN_DEVICE"));  // or the best there is
  auto settings = parian::make<parian_settings>();
  settings.error = 1e-2;
  settings.fixed_cameras = 1;
  renderer.set(settings);
  renderer.set_mesh(positions, indices);
  renderer.set(parian::material({2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5));
  renderer.set(parian::light({0.5, 0.6, -0.6}, {3.14, 3.14, 3.14}));
  renderer.set(parian::camera({0, 120, 250}, {0, 0, 0}, 30), width, height);

  renderer.plan();
  do {
    renderer.frame();
  } while (!renderer.estimate_due() || renderer.estimate() > settings.error);
  std::vector<float> rgba(4 * width * height);
  const double error = renderer.read(0, rgba);

  double covered = 0, radiance = 0;
  for (std::size_t i = 0; i < rgba.size(); i += 4) {
    covered += rgba[i + 3];
    radiance += (rgba[i] + rgba[i + 1] + rgba[i + 2]) / 3;
  }
  std::cout << "parian " << parian_version() << ": " << renderer.statistics().frames << " frames, estimated relMSE "
            << error << ", " << covered << " pixels covered, mean radiance " << radiance / covered << '\n';
  if (argc > 1) {
    std::ofstream file(argv[1], std::ios::binary);  // rows from the bottom up
    file << "PF\n" << width << ' ' << height << "\n-1.0\n";
    for (std::size_t y = height; y-- > 0;)
      for (std::size_t x = 0; x < width; ++x)
        file.write(reinterpret_cast<const char*>(&rgba[4 * (y * width + x)]), 3 * sizeof(float));
  }
  return error <= settings.error && covered > 500 && radiance > 0 ? 0 : 1;
} catch (const std::exception& failure) {
  std::cerr << "minimal: " << failure.what() << '\n';
  return 1;
}
