#include "lab/doctor/joint_names.hpp"

#include <algorithm>
#include <cctype>
#include <set>

namespace kilvo::lab {
namespace {

// Without a namespace and the word joint.
std::multiset<std::string> words_of(const std::string& name) {
  std::multiset<std::string> out;
  std::string word;
  const auto end_word = [&] {
    if (word == "l") word = "left";
    if (word == "r") word = "right";
    if (!word.empty() && word != "joint") out.insert(word);
    word.clear();
  };
  const auto is = [](int (*kind)(int), char c) { return kind(static_cast<unsigned char>(c)) != 0; };
  char before = 0;
  for (const char c : name.substr(name.rfind('/') + 1)) {
    if (!is(std::isalnum, c) || (is(std::isupper, c) && is(std::islower, before))) end_word();
    if (is(std::isalnum, c)) word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    before = c;
  }
  end_word();
  return out;
}

}  // namespace

std::map<std::string, std::string> matching_names(const std::vector<std::string>& joints, const std::vector<std::string>& message_names) {
  std::map<std::string, std::string> out;
  std::set<std::string> taken;
  for (const std::string& joint : joints) {
    if (std::ranges::find(message_names, joint) != message_names.end()) continue;
    const auto is_same = [words = words_of(joint)](const std::string& name) { return words_of(name) == words; };
    const auto found = std::ranges::find_if(message_names, is_same);
    if (found == message_names.end() || std::ranges::count_if(message_names, is_same) > 1 || !taken.insert(*found).second) return {};
    out.emplace(joint, *found);
  }
  return out;
}

}  // namespace kilvo::lab
