// Every mistake of a configuration at once.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lab/settings/settings.hpp"

namespace kilvo::lab {

class Problems {
 public:
  /// Calls `check`; a ConfigError is kept for later.
  template <class Check>
  void collect(Check&& check) {
    try {
      std::forward<Check>(check)();
    } catch (const ConfigError& error) {
      texts_.emplace_back(error.what());
    }
  }

  bool none() const { return texts_.empty(); }

  /// Throws one ConfigError of all that was kept, a line each.
  void report() const {
    std::string all;
    for (const std::string& text : texts_) all += (all.empty() ? "" : "\n") + text;
    if (!all.empty()) throw ConfigError(all);
  }

 private:
  std::vector<std::string> texts_;
};

}  // namespace kilvo::lab
