// Opens a page as a person would, without a screen.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace kilvo::stories {

struct OpenedPage {
  int code = -1;
  std::string dom;        // the page after its scripts have run, as HTML
  std::string console;    // what was printed on the console, one line each
  nlohmann::json drawn;   // what the report says it has drawn; null when it says nothing
  nlohmann::json probed;  // what a script of the test has left in an element `probe`
};

/// In a window 1200 pixels wide. The browser has no network to ask.
OpenedPage open_page(const std::filesystem::path& page);

/// In a frame of this width: a browser's own window cannot be as narrow as a phone. Only `drawn` and `console` are told.
OpenedPage open_narrow(const std::filesystem::path& page, int width);

/// A copy of the page in which `script` runs after the page's own; what it gives to probe(...) comes back as `probed`.
OpenedPage open_and_probe(const std::filesystem::path& page, const std::string& script);

}  // namespace kilvo::stories
