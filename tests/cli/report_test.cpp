// kilvo report and kilvo eval-contacts.
#include <algorithm>
#include <filesystem>

#include "tests/cli/browser.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace report_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;
using testing::UnorderedElementsAre;

constexpr std::int64_t demo_start_s = 1700000000;

/// A row each 5 ms for 6 s: left is up from 3.0 to 3.4 s and from 4.6 to 5.0 s, right from 3.8 to 4.2 s, all shifted by `shift` rows.
std::string contact_table(int shift, bool with_clearance) {
  std::string text = with_clearance ? "t,left,right,clearance_left,clearance_right,d_a\n" : "t,left,right\n";
  for (int row = 0; row < 1200; ++row) {
    const auto up = [&](int from, int to) { return from + shift <= row && row < to + shift; };
    const bool left = up(600, 680) || up(920, 1000), right = up(760, 840);
    const std::string decimals = std::to_string(1000 + row % 200 * 5).substr(1);
    text += std::to_string(demo_start_s + row / 200) + "." + decimals + (left ? ",0" : ",1") + (right ? ",0" : ",1");
    if (with_clearance) text += std::string(left ? ",0.05" : ",0") + (right ? ",nan" : ",0.001") + ",1";
    text += "\n";
  }
  return text;
}

class Report : public Story {
 protected:
  void SetUp() override {
    ASSERT_TRUE(fs::exists(KILVO_BROWSER)) << "no chromium here: scripts/install_dependencies";
    for (const std::vector<std::string>& words : {std::vector<std::string>{"simulate", "room", "--out", folder / "demo", "--duration", "6"},
                                                  {"run", folder / "demo", "--out", results(), "--sensors", "imu,lidar", "--quiet"},
                                                  {"report", results(), "--gt", truth()}}) {
      const Finished f = kilvo(words);
      ASSERT_EQ(f.code, 0) << f.err;
    }
    ASSERT_TRUE(fs::exists(page()));
  }

  std::string results(const std::string& file = "") const { return folder / ("demo/results" + (file.empty() ? "" : "/" + file)); }
  std::string page() const { return results("report.html"); }
  std::string truth() const { return folder / "demo/gt.tum"; }

  Finished report(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"report", results()};
    words.insert(words.end(), more.begin(), more.end());
    return kilvo(words);
  }

  /// Opens the page and checks that it is whole.
  OpenedPage opened() const {
    OpenedPage p = open_page(page());
    EXPECT_EQ(p.code, 0);
    EXPECT_EQ(p.console, "");
    EXPECT_TRUE(p.drawn.is_object());
    EXPECT_EQ(p.drawn.value("errors", nlohmann::json()), nlohmann::json::array());
    for (const std::string& id : figures_of(p)) EXPECT_GT(p.drawn["figures"][id], 0) << id;
    return p;
  }

  static std::vector<std::string> figures_of(const OpenedPage& p) {
    std::vector<std::string> ids;
    const nlohmann::json figures = p.drawn.value("figures", nlohmann::json::object());
    for (const auto& [id, n] : figures.items()) ids.push_back(id);
    return ids;
  }

  void expect_refused(const std::vector<std::string>& words, const std::string& text, int code = 3) const {
    const Finished f = kilvo(words);
    EXPECT_EQ(f.code, code) << f.err;
    EXPECT_THAT(f.err, AllOf(StartsWith("kilvo: error: "), HasSubstr(text)));
    EXPECT_EQ(std::count(f.err.begin(), f.err.end(), '\n'), 1) << f.err;
  }
};

TEST_F(Report, ThePageHasEveryFigureOfALidarInertialRun) {
  const OpenedPage p = opened();
  EXPECT_THAT(figures_of(p), UnorderedElementsAre("map", "path_top", "path_side", "error", "error_position", "error_rotation", "velocity",
                                                  "biases", "modality", "messages", "rates", "intervals", "stages", "stage_histogram",
                                                  "stage_table", "summary", "config"));
  const auto& figures = p.drawn["figures"];
  EXPECT_GT(figures["map"], 10000);
  EXPECT_GT(figures["path_top"], 100);        // 59 sweeps, estimated and true
  EXPECT_GT(figures["error"], 100);           // two panels of them
  EXPECT_GT(figures["error_position"], 150);  // three
  EXPECT_GT(figures["velocity"], 300);        // three, estimated and true
  EXPECT_EQ(figures["modality"], 1);
  EXPECT_EQ(figures["messages"], 10);  // imu, lidar: name, topic, used, Hz, dropped
  EXPECT_GT(figures["config"], 100);
  EXPECT_THAT(p.dom, AllOf(HasSubstr(">Position error<"), HasSubstr("<h1 id=\"name\">demo</h1>")));
}

TEST_F(Report, ContactsAreComparedWithTheTruth) {
  write_text(results("contacts.csv"), contact_table(2, true));
  write_text(folder / "contacts.csv", contact_table(0, false));
  ASSERT_EQ(report({"--gt", truth(), "--gt-contacts", folder / "contacts.csv"}).code, 0);
  const OpenedPage p = opened();
  EXPECT_THAT(figures_of(p), AllOf(Contains("contacts"), Contains("clearance"), Contains("transitions"), Contains("contact_table")));
  EXPECT_EQ(p.drawn["figures"]["contacts"], 10);  // three stances of the left foot, two of the right, estimated and true
  EXPECT_THAT(p.dom, HasSubstr("Touchdowns found: left 2 of 2, right 1 of 1."));
}

TEST_F(Report, PlaybackMovesTheCursorOfTime) {
  const OpenedPage p = open_and_probe(page(), R"(
const place = document.querySelector('#figure-map .place'), button = document.querySelector('#figure-map .play');
place.value = 500; place.dispatchEvent(new Event('input'));
const half = timeView.cursor, frames = [];
window.requestAnimationFrame = (frame) => frames.push(frame);  // the clock of this test
button.click();
const playing = button.textContent, begin = performance.now();
for (const later of [100, 200]) for (const frame of frames.splice(0)) frame(begin + later);
probe({half, playing, later: timeView.cursor, reading: document.querySelector('#figure-map .reading').textContent});
)");
  EXPECT_EQ(p.console, "");
  ASSERT_TRUE(p.probed.is_object());
  EXPECT_NEAR(p.probed["half"], 3.0, 0.1);
  EXPECT_EQ(p.probed["playing"], "Pause");
  EXPECT_NEAR(p.probed["later"], 3.2, 0.1);
  EXPECT_NEAR(std::stod(p.probed["reading"].get<std::string>()), 3.2, 0.11);  // in seconds, one decimal
}

TEST_F(Report, ARunThatDivergedHasARedLineOnTop) {
  EXPECT_EQ(read_text(page()).find("the estimate diverged"), std::string::npos);
  nlohmann::json summary = nlohmann::json::parse(read_text(results("summary.json")));
  summary["diverged"] = true;
  write_text(results("summary.json"), summary.dump());
  ASSERT_EQ(report({"--gt", truth()}).code, 0);
  const OpenedPage p = opened();
  EXPECT_THAT(p.dom, AllOf(HasSubstr("class=\"distrust\""), HasSubstr("the estimate diverged")));
}

TEST_F(Report, APhoneShowsItWithoutScrollingSideways) {
  const OpenedPage p = open_narrow(page(), 390);
  EXPECT_EQ(p.console, "");
  ASSERT_TRUE(p.drawn.is_object());
  EXPECT_EQ(p.drawn["window"], 390);
  EXPECT_LE(p.drawn["width"], 390);
  EXPECT_EQ(p.drawn["errors"], nlohmann::json::array());
}

TEST_F(Report, IsOneSmallFileThatAsksForNothingElse) {
  EXPECT_LT(fs::file_size(page()), 10'000'000);
  const std::string html = read_text(page());
  for (const char* word : {"src=", "@import", "url(h", "fetch(", "https://"}) EXPECT_EQ(html.find(word), std::string::npos) << word;
}

TEST_F(Report, AnswersToThePointer) {
  const OpenedPage p = open_and_probe(page(), R"(
const chart = document.querySelector('#figure-velocity svg'), map = document.querySelector('#figure-map canvas');
point(chart, 'pointermove', 400, 40);
const read = document.querySelector('#figure-velocity .read').textContent, others = document.querySelector('#figure-biases .read').textContent;
const before = timeView.domain.slice();
point(chart, 'pointerdown', 200, 40, {button: 0}); point(chart, 'pointermove', 400, 40); point(chart, 'pointerup', 400, 40);
const zoomed = timeView.domain.slice(), offered = !document.getElementById('all').hidden;
document.getElementById('all').click();
const pixels = () => map.getContext('2d').getImageData(0, 0, map.width, map.height).data.reduce((sum, x, i) => (sum * 31 + x * (i % 97)) % 1000003, 0);
const first = pixels();
point(map, 'pointerdown', 300, 200); point(map, 'pointermove', 380, 230, {buttons: 1}); point(map, 'pointerup', 380, 230);
requestAnimationFrame(() => probe({read, others, before, zoomed, offered, after: timeView.domain, turned: pixels() !== first}));
)");
  EXPECT_EQ(p.console, "");
  ASSERT_TRUE(p.probed.is_object());
  EXPECT_FALSE(p.probed["read"].get<std::string>().empty());
  EXPECT_FALSE(p.probed["others"].get<std::string>().empty());
  EXPECT_GT(p.probed["zoomed"][0], p.probed["before"][0]);
  EXPECT_LT(p.probed["zoomed"][1], p.probed["before"][1]);
  EXPECT_TRUE(p.probed["offered"]);
  EXPECT_EQ(p.probed["after"], p.probed["before"]);
  EXPECT_TRUE(p.probed["turned"]);
}

TEST_F(Report, WhatIsNotThereIsLeftOutWithAWord) {
  for (const char* file : {"sweeps.tum", "states.csv", "modality.csv", "timing.csv", "map.ply", "summary.json"}) fs::remove(results(file));
  const Finished f = report();
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, AllOf(HasSubstr("states.csv"), HasSubstr("map.ply")));
  const OpenedPage p = opened();
  EXPECT_THAT(figures_of(p), UnorderedElementsAre("path_top", "path_side", "rates", "intervals"));
  EXPECT_THAT(p.dom, AllOf(HasSubstr("Not in the folder, so not shown: "), HasSubstr("no truth was given")));
  write_text(results("odometry.tum"), "");
  const Finished empty = report();
  EXPECT_EQ(empty.code, 0);
  EXPECT_THAT(empty.err, HasSubstr("no pose in it"));
  EXPECT_THAT(figures_of(opened()), UnorderedElementsAre());
}

TEST_F(Report, TextOfFilesIsTextAndNothingElse) {
  const std::string evil = "</script><img src=x onerror=console.log(1)>";
  auto summary = nlohmann::json::parse(read_text(results("summary.json")));
  summary["warnings"] = {evil};
  summary["input"] = evil;
  summary["messages"]["<i>imu"] = {{"topic", evil}, {"used", 1}, {"dropped", {{"<u>", 2}}}};
  summary[evil] = evil;
  write_text(results("summary.json"), summary.dump());
  write_text(results("modality.csv"), "t,modality,cause\n1700000000,LI,\"" + evil + "\"\n1700000003,<b>LI</b>,{{data}}\n");
  ASSERT_EQ(report().code, 0);
  const OpenedPage p = opened();
  EXPECT_EQ(p.dom.find("<img"), std::string::npos);
  EXPECT_THAT(p.dom, HasSubstr("&lt;/script&gt;&lt;img"));
}

TEST_F(Report, FoldersAndFilesThatAreNotAsTheyShouldBe) {
  expect_refused({"report", folder / "missing"}, "missing: there is no such folder");
  expect_refused({"report", folder / "demo"}, "odometry.tum: is missing");
  expect_refused({"report", results(), "--gt", folder / "no.tum"}, "no.tum");
  expect_refused({"report", results(), "--gt-contacts", folder / "no.csv"}, "no.csv");
  write_text(folder / "far.tum", "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  expect_refused({"report", results(), "--gt", folder / "far.tum"}, "far.tum: only 0 estimates");
  const std::pair<const char*, const char*> broken[] = {{"states.csv", "t,vx\n1,2\n"},
                                                        {"timing.csv", "t,stage,microseconds\n1700000000.1,lidar,nan\n"},
                                                        {"modality.csv", "t,modality,cause\n1,LI\n"},
                                                        {"contacts.csv", "t,left,right\n1,1,2\n"},
                                                        {"map.ply", "ply\nhello\n"},
                                                        {"summary.json", "{\"version\": "},
                                                        {"sweeps.tum", "1 2 3\n"},
                                                        {"odometry.tum", "1 nan 0 0 0 0 0 1\n"}};
  for (const auto& [file, text] : broken) {
    const std::string good = fs::exists(results(file)) ? read_text(results(file)) : "";
    write_text(results(file), text);
    expect_refused({"report", results()}, file);
    good.empty() ? static_cast<void>(fs::remove(results(file))) : write_text(results(file), good);
  }
  fs::remove(page());
  fs::create_directory(page());
  expect_refused({"report", results()}, "report.html", 2);
}

TEST(EvalContacts, PrintsTextOrJson) {
  const TemporaryFolder folder;
  write_text(folder / "gt.csv", contact_table(0, false));
  write_text(folder / "est.csv", contact_table(1, true));
  const Finished text = kilvo({"eval-contacts", folder / "est.csv", folder / "gt.csv"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("2/1 correct of 2/1 true"), HasSubstr("left touchdowns     median +5.0")));
  const Finished json = kilvo({"eval-contacts", folder / "est.csv", folder / "gt.csv", "--json"});
  const auto result = nlohmann::json::parse(json.out);
  // From 3.0 to 5.0 s less half a sample there are 400 samples; left is wrong in one at each of two lift-offs and one touchdown.
  EXPECT_NEAR(result["left"]["accuracy"], 1 - 3.0 / 400, 1e-9);
  EXPECT_NEAR(result["right"]["false_positive_rate"], 1.0 / 80, 1e-9);
  EXPECT_EQ(kilvo({"eval-contacts", folder / "est.csv", folder / "no.csv"}).code, 3);
  write_text(folder / "bad.csv", "t,left\n1,1\n");
  const Finished bad = kilvo({"eval-contacts", folder / "bad.csv", folder / "gt.csv"});
  EXPECT_EQ(bad.code, 3);
  EXPECT_THAT(bad.err, HasSubstr("bad.csv:1: there is no column 'right'"));
}

}  // namespace report_test
}  // namespace kilvo::stories
