#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

std::string plain_type_name(std::string_view name) {
  constexpr std::string_view dds = "::msg::dds_::", ros2 = "/msg/", cpp = "::msg::";
  for (const std::string_view between : {dds, ros2, cpp}) {
    const std::size_t at = name.find(between);
    if (at == std::string_view::npos) continue;
    std::string_view last = name.substr(at + between.size());
    if (between == dds && last.ends_with('_')) last.remove_suffix(1);
    return std::string(name.substr(0, at)) + "/" + std::string(last);
  }
  return std::string(name);
}

std::string ros2_type_name(std::string_view plain) {
  const std::size_t slash = plain.find('/');
  if (slash == std::string_view::npos || plain.find('/', slash + 1) != std::string_view::npos) return std::string(plain);
  return std::string(plain.substr(0, slash)) + "/msg" + std::string(plain.substr(slash));
}

}  // namespace kilvo::lab
