// One setting of a configuration struct. The struct lists its fields once, as `static constexpr auto fields()` returning a std::tuple of
// Field; YAML loading, `--set`, `kilvo config show` and docs/parameters.md all come from that list.
#pragma once

#include <string_view>

namespace kilvo {

template <class Config, class Value>
struct Field {
  std::string_view name;     // as spelled in the YAML file
  Value Config::*member;     // where it is stored
  std::string_view unit;     // SI unit, "-" when it has none
  std::string_view meaning;  // one sentence
};
template <class Config, class Value>
Field(const char*, Value Config::*, const char*, const char*) -> Field<Config, Value>;

}  // namespace kilvo
