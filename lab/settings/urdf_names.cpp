#include "lab/settings/urdf_names.hpp"

#include <algorithm>
#include <cctype>

namespace kilvo::lab {
namespace {

bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

// The value of the attribute `name` of a tag's text: link name="pelvis" /
std::string_view name_attribute(std::string_view tag) {
  for (std::size_t at = tag.find("name"); at != std::string_view::npos; at = tag.find("name", at + 1)) {
    if (at == 0 || !is_space(tag[at - 1])) continue;
    std::string_view rest = trimmed(tag.substr(at + 4));
    if (!rest.starts_with('=')) continue;
    rest = trimmed(rest.substr(1));
    if (rest.empty() || (rest.front() != '"' && rest.front() != '\'')) continue;
    const std::size_t end = rest.find(rest.front(), 1);
    if (end != std::string_view::npos) return rest.substr(1, end - 1);
  }
  return {};
}

}  // namespace

UrdfNames find_urdf_names(std::string_view urdf) {
  UrdfNames out;
  const auto keep = [](std::vector<std::string>& names, std::string_view name) {
    if (!name.empty() && std::ranges::find(names, name) == names.end()) names.emplace_back(name);
  };
  std::size_t at = 0;
  while ((at = urdf.find('<', at)) != std::string_view::npos) {
    const bool comment = urdf.substr(at).starts_with("<!--");
    const std::size_t end = urdf.find(comment ? "-->" : ">", at);
    if (end == std::string_view::npos) break;
    const std::string_view tag = urdf.substr(at + 1, end - at - 1);
    // "link" and "joint" only, not e.g. <linkage>
    const std::string_view kind = tag.substr(0, std::min(tag.size(), tag.find_first_of(" \t\r\n/")));
    if (!comment && kind == "link") keep(out.links, name_attribute(tag));
    if (!comment && kind == "joint") keep(out.joints, name_attribute(tag));
    at = end + 1;
  }
  return out;
}

}  // namespace kilvo::lab
