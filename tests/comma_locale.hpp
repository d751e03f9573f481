// A program that speaks German: 1,5 is one and a half, to C's library or to C++'s.
#pragma once
#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <locale>
#include <string>

#include "scratch.hpp"

namespace parian::test {

enum class Library { c, cpp };

/// Until its end, numbers have a comma; `there` is false where no such locale can be made.
class CommaLocale {
 public:
  explicit CommaLocale(Library library) {
    if (library == Library::cpp) {
      std::locale::global(std::locale(std::locale::classic(), new Commas));
      there_ = true;
      return;
    }
    const std::string folder = (scratch_ / "").string();
    const std::string make = "localedef -i de_DE -f UTF-8 " + folder + "de_DE.UTF-8 >/dev/null 2>&1";
    if (std::system(make.c_str()) != 0) return;
    setenv("LOCPATH", folder.c_str(), 1);
    there_ = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
    if (there_ && std::strtod("1,5", nullptr) != 1.5) ADD_FAILURE() << "it has no comma";
  }
  ~CommaLocale() {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;
  [[nodiscard]] bool there() const { return there_; }

 private:
  struct Commas : std::numpunct<char> {
    [[nodiscard]] char do_decimal_point() const override { return ','; }
    [[nodiscard]] char do_thousands_sep() const override { return '.'; }
    [[nodiscard]] std::string do_grouping() const override { return "\3"; }
  };

  Scratch scratch_;
  bool there_ = false;
};

/// Of tests that run in both libraries' locales.
class InCommaLocale : public testing::TestWithParam<Library> {};

inline std::string library_name(const testing::TestParamInfo<Library>& info) {
  return info.param == Library::c ? "C" : "Cpp";
}

}  // namespace parian::test
