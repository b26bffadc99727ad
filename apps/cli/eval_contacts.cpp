// kilvo eval-contacts EST.csv GT.csv
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/evaluation/contacts.hpp"

namespace kilvo::cli {
namespace {

struct EvalContactsOptions {
  std::string estimate, truth;
  bool json = false;
};

int evaluate_files(const EvalContactsOptions& options) {
  const lab::ContactEvaluation result = lab::evaluate_contacts(lab::read_contacts(options.estimate), lab::read_contacts(options.truth));
  fmt::print("{}", options.json ? lab::to_json(result) : lab::to_text(result));
  return done;
}

}  // namespace

void add_eval_contacts(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<EvalContactsOptions>();
  CLI::App* verb = program.add_subcommand("eval-contacts", "compare estimated contacts with the truth");
  verb->add_option("EST", options->estimate, "estimated contacts (CSV with the columns t, left, right: 0 or 1)")->required();
  verb->add_option("GT", options->truth, "true contacts, in the same columns, at any rate")->required();
  verb->add_flag("--json", options->json, "print one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return evaluate_files(*options); }; });
}

}  // namespace kilvo::cli
