// What a decoder gives back: the value, or the reason why there is none. A bad message is data, not an exception.
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace kilvo::lab {

struct DecodeError {
  std::string reason;  // for a person: "the header ends after 7 bytes"
};

template <class T>
class [[nodiscard]] Decoded {
 public:
  Decoded(T value) : content_(std::move(value)) {}            // NOLINT(google-explicit-constructor): `return value;` reads best
  Decoded(DecodeError error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return content_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// Only when ok().
  T& operator*() & { return std::get<0>(content_); }
  const T& operator*() const& { return std::get<0>(content_); }
  T&& operator*() && { return std::get<0>(std::move(content_)); }
  T* operator->() { return &std::get<0>(content_); }
  const T* operator->() const { return &std::get<0>(content_); }

  /// Why not; empty when ok().
  std::string reason() const { return ok() ? std::string() : std::get<1>(content_).reason; }

 private:
  std::variant<T, DecodeError> content_;
};

}  // namespace kilvo::lab
