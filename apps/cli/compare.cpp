// kilvo compare RUN... --gt GT.tum
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/report/comparison.hpp"

namespace kilvo::cli {
namespace {

struct CompareWords {
  std::vector<std::string> runs;
  std::string truth, align = "se3", out;
  bool json = false;
};

int compare(const CompareWords& words) {
  const lab::Comparison comparison = lab::compare_runs(words.runs, words.truth, alignment_or_refuse(words.align));
  fmt::print("{}", words.json ? lab::to_json(comparison) : lab::to_text(comparison));
  if (!words.out.empty()) write_text_file(words.out, lab::to_html(comparison));
  return done;
}

}  // namespace

void add_compare(CLI::App& program, Action& chosen) {
  auto words = std::make_shared<CompareWords>();
  CLI::App* verb = program.add_subcommand("compare", "several runs against one truth: a table, and their paths over each other");
  verb->add_option("RUN", words->runs, "folders that `kilvo run` wrote, or trajectories (TUM)")->required()->expected(1, 64);
  verb->add_option("--gt", words->truth, "true trajectory (TUM), of the same body")->type_name("GT.tum")->required();
  verb->add_option("--align", words->align, "se3 (the default), yaw, first: as in kilvo eval");
  verb->add_option("--out", words->out, "write a page with the paths and errors over each other")->type_name("FILE.html");
  verb->add_flag("--json", words->json, "print one JSON object");
  verb->callback([words, &chosen] { chosen = [words] { return compare(*words); }; });
}

}  // namespace kilvo::cli
