#include <fmt/core.h>

#include "lab/settings/setting_list.hpp"

namespace kilvo::lab {
namespace {

std::string json_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20) {
      out += fmt::format("\\u{:04x}", byte);
    } else {
      out += c;
    }
  }
  return out + '"';
}

// One name for all, so that lists of anything can be written.
std::string text_of(double x) { return fmt::format("{}", x); }
std::string text_of(int x) { return fmt::format("{}", x); }
std::string text_of(bool x) { return x ? "true" : "false"; }
std::string text_of(const std::string& x) { return json_text(x); }

template <class List>
std::string list_text(const List& list);

std::string text_of(const Eigen::Vector3d& x) { return list_text(std::vector<double>(x.data(), x.data() + 3)); }
std::string text_of(const SO3& R) {
  const Eigen::Matrix3d row_by_row = R.matrix().transpose();
  // Minus zero says nothing.
  std::vector<double> numbers(row_by_row.data(), row_by_row.data() + 9);
  for (double& n : numbers) n += 0.0;
  return list_text(numbers);
}
std::string text_of(const Foot& foot) {
  return fmt::format(R"({{"name": {}, "link": {}, "sole": {}}})", json_text(foot.name), json_text(foot.link), list_text(foot.sole));
}
// What is as it is without an entry is left out.
std::string text_of(const std::map<std::string, JointReading>& joints) {
  std::string out;
  for (const auto& [name, joint] : joints) {
    std::string entry;
    const auto add = [&entry](const char* key, const std::string& value) {
      entry += fmt::format(R"({}"{}": {})", entry.empty() ? "" : ", ", key, value);
    };
    if (!joint.from.empty()) add("from", json_text(joint.from));
    if (joint.sign != 1) add("sign", text_of(joint.sign));
    if (joint.zero != 0) add("zero", text_of(joint.zero));
    out += fmt::format("{}{}: {{{}}}", out.empty() ? "" : ", ", json_text(name), entry);
  }
  return "{" + out + "}";
}

template <class T>
std::string text_of(const std::vector<T>& list) {
  return list_text(list);
}
std::string text_of(const std::array<Foot, 2>& feet) { return list_text(feet); }

template <class List>
std::string list_text(const List& list) {
  std::string out = "[";
  for (const auto& entry : list) {
    if (out.size() > 1) out += ", ";
    out += text_of(entry);
  }
  return out += "]";
}

}  // namespace

std::string value_text(const SettingValue& value) {
  return std::visit([](const auto* x) { return text_of(*x); }, value);
}

}  // namespace kilvo::lab
