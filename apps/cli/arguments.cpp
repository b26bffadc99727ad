#include "apps/cli/arguments.hpp"

#include <algorithm>
#include <charconv>
#include <fmt/core.h>

#include "apps/cli/exit_code.hpp"
#include "lab/settings/nearest.hpp"

namespace kilvo::cli {
namespace {

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::App* verb : app.get_subcommands({})) out.push_back(verb->get_name());
  return out;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
  }
  return out;
}

void check_option(const std::string& word, const CLI::App& app) {
  const std::vector<std::string> options = options_of(app);
  const std::string name = word.substr(0, word.find('='));
  if (std::ranges::find(options, name) != options.end()) return;
  throw UsageError(fmt::format("{}: no option '{}', nearest is '{}'", app.get_name(), name, lab::nearest(name, options)));
}

// An option whose value may be left out takes the next word only if that is one.
bool is_number(const std::string& word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

}  // namespace

std::vector<std::string> with_values(std::vector<std::string> words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] != "--realtime" || (i + 1 < words.size() && is_number(words[i + 1]))) continue;
    words[i] += "=1";
  }
  return words;
}

void check_arguments(const std::vector<std::string>& words, const CLI::App& program) {
  const CLI::App* app = &program;
  for (const std::string& word : words) {
    if (word == "--") return;
    if (word.starts_with("--")) {
      check_option(word, *app);
      continue;
    }
    const std::vector<std::string> verbs = verbs_of(*app);
    if (word.starts_with("-") || verbs.empty()) continue;
    if (std::ranges::find(verbs, word) == verbs.end()) {
      throw UsageError(fmt::format("{}: no verb '{}', nearest is '{}'", app->get_name(), word, lab::nearest(word, verbs)));
    }
    app = app->get_subcommand(word);
  }
}

}  // namespace kilvo::cli
