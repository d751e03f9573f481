// What settings are called: by the command line's names to its users, by the API's to those of the library.
#include "core/words.hpp"

#include <gtest/gtest.h>
#include <parian/parian.h>

#include "core/error.hpp"
#include "io/scene_file.hpp"
#include "session/rendering.hpp"
#include "test_device.hpp"

namespace parian {
namespace {

const std::string marked = "lower " + setting("layer_size") + "; " + setting("gather_layers") + ", a larger " +
                           setting("film") + ", or choose another" + setting("with_device");

TEST(Words, OfEachFront) {
  EXPECT_EQ(in_api_words(marked), "lower layer_size; views PARIAN_LAYERS, a larger film, or choose another");
  EXPECT_EQ(in_command_words(marked),
            "lower --layer-size; --gather layers, a larger --size, or choose another with --device");
  // Names of others stay as they are, whatever they look like.
  for (const std::string text : {"material '--layer-size layer_size': no", "a_b.ply: --force", ""}) {
    EXPECT_EQ(in_api_words(text), text);
    EXPECT_EQ(in_command_words(text), text);
  }
  EXPECT_EQ(in_api_words("cut \x1a"), "cut ");
}

// The same failures, seen from both sides.
TEST(Words, OfFailures) {
  const auto failure = [](auto&& change, bool by_command) -> std::string {
    Input input = load_input(PARIAN_MESHES "/sphere.ply", {});
    change(input.settings);
    try {
      const Rendering rendering(std::move(input.scene), input.settings, test_selector());
    } catch (const Error& error) {
      return by_command ? error.what() : parian_message();
    }
    return "none";
  };
  const auto told = [&](auto&& change, const std::string& command, const std::string& api) {
    const std::string to_user = failure(change, true), to_embedder = failure(change, false);
    EXPECT_NE(to_user.find(command), std::string::npos) << to_user;
    EXPECT_NE(to_embedder.find(api), std::string::npos) << to_embedder;
    EXPECT_EQ(to_embedder.find("--"), std::string::npos) << to_embedder;
  };
  told([](Settings& s) { s.keep = {"nonsense"}; }, "--keep nonsense: nothing", "keep nonsense: nothing");
  told([](Settings& s) { s.frames = 0xffffffff; }, "--frames times --samples", "frames times samples");
  told(
      [](Settings& s) {
        s.layers = 1024;
        s.layer_size = 16384;
        s.gather = Gather::layers;
      },
      "lower --layer-size, --layers or --light-map-size", "lower layer_size, layers or light_map_size");
}

}  // namespace
}  // namespace parian
