// Marks in messages, and what they become.
#include "core/words.hpp"

#include <algorithm>
#include <array>

namespace parian {
namespace {

constexpr char mark = '\x1a';  // before and after a name; control bytes of others' names end here, too

struct Words {
  std::string_view name, api, command;
};
constexpr std::array exceptions{Words{"film", "film", "--size"},
                                Words{"gather_layers", "views PARIAN_LAYERS", "--gather layers"},
                                Words{"with_device", "", " with --device"}};

template <class F>
std::string replaced(const std::string& message, F&& words_of) {
  std::string text;
  for (std::size_t i = 0; i < message.size();) {
    const std::size_t begin = std::min(message.find(mark, i), message.size());
    text.append(message, i, begin - i);
    if (begin == message.size()) break;
    const std::size_t end = std::min(message.find(mark, begin + 1), message.size());
    text += words_of(std::string_view(message).substr(begin + 1, end - begin - 1));
    i = end + 1;
  }
  return text;
}

const Words* exception(std::string_view name) {
  const auto* found =
      std::find_if(exceptions.begin(), exceptions.end(), [&](const Words& w) { return w.name == name; });
  return found == exceptions.end() ? nullptr : found;
}

}  // namespace

std::string setting(std::string_view name) { return mark + std::string(name) + mark; }

std::string in_api_words(const std::string& message) {
  return replaced(message, [](std::string_view name) {
    const Words* other = exception(name);
    return std::string(other ? other->api : name);
  });
}

std::string in_command_words(const std::string& message) {
  return replaced(message, [](std::string_view name) {
    if (const Words* other = exception(name)) return std::string(other->command);
    std::string option = "--" + std::string(name);
    std::replace(option.begin(), option.end(), '_', '-');
    return option;
  });
}

}  // namespace parian
