// kilvo report DIR
#include "lab/report/report.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/verbs.hpp"

namespace kilvo::cli {
namespace {

struct ReportWords {
  std::string folder, truth, true_contacts;
};

int report(const ReportWords& words) {
  lab::ReportOptions options{words.folder, {}, {}};
  if (!words.truth.empty()) options.truth = words.truth;
  if (!words.true_contacts.empty()) options.true_contacts = words.true_contacts;
  const lab::Report made = lab::make_report(options);
  const std::filesystem::path path = options.folder / "report.html";
  write_text_file(path, made.html);
  if (!made.left_out.empty()) fmt::print(stderr, "kilvo: not in the folder, so not in the report: {}\n", fmt::join(made.left_out, ", "));
  fmt::print("{}\n", path.string());
  return done;
}

}  // namespace

void add_report(CLI::App& program, Action& chosen) {
  auto words = std::make_shared<ReportWords>();
  CLI::App* verb = program.add_subcommand("report", "show a run as one page with pictures, DIR/report.html");
  verb->add_option("DIR", words->folder, "folder that `kilvo run` wrote")->required();
  verb->add_option("--gt", words->truth, "true trajectory (TUM), of the same body")->type_name("GT.tum");
  verb->add_option("--gt-contacts", words->true_contacts, "true contacts (CSV with the columns t, left, right)")->type_name("GT.csv");
  verb->callback([words, &chosen] { chosen = [words] { return report(*words); }; });
}

}  // namespace kilvo::cli
