// The one exception type used inside Parian: what is wrong, and which kind of wrong (the kind is the exit code).
#pragma once
#include <stdexcept>
#include <string>

namespace parian {

enum class ErrorKind : int { usage = 2, input = 3, device = 4, output = 5 };

class Error : public std::runtime_error {
 public:
  /// `message` reads "PLACE: what is wrong; what to do" on one line, without the leading "parian: ".
  /// `code` is the OpenCL code behind it, 0 if there is none.
  Error(ErrorKind kind, const std::string& message, int code = 0)
      : std::runtime_error(message), kind_(kind), code_(code) {}
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  [[nodiscard]] int code() const noexcept { return code_; }

 private:
  ErrorKind kind_;
  int code_;
};

}  // namespace parian
